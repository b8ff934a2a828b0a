#include "physics/worker_team.h"

namespace hydrostat::physics {
namespace {

constexpr std::uint64_t kOneRound = std::uint64_t{1} << 32;
constexpr int kLooks = 1000;  // for what others do, before sleeping: some ten microseconds, about what waking takes

/// Looks at a value for a while, then sleeps, until it is another than `old`.
void wait_for_change(const std::atomic<int>& value, int old) {
  for (int look = 0; look < kLooks; ++look) {
    if (value.load(std::memory_order_acquire) != old) return;
#ifdef __x86_64__
    __builtin_ia32_pause();
#endif
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

WorkerTeam::WorkerTeam(int threads) {
  for (int k = 1; k < threads; ++k) helpers_.emplace_back([this] { wait_and_help(); });
}

WorkerTeam::~WorkerTeam() {
  is_over_ = true;
  ++round_;
  round_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void WorkerTeam::run(int parts, Call call, const void* work) {
  if (helpers_.empty() || parts < 2) {
    for (int part = 0; part < parts; ++part) call(work, part);
    return;
  }
  call_.store(call, std::memory_order_relaxed);
  work_.store(work, std::memory_order_relaxed);
  undone_.store(parts, std::memory_order_relaxed);
  const std::uint64_t last = ticket_.load(std::memory_order_relaxed);
  ticket_.store((last / kOneRound + 1) * kOneRound + static_cast<std::uint64_t>(parts), std::memory_order_release);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  help();
  for (int undone = undone_.load(std::memory_order_acquire); undone > 0; undone = undone_.load(std::memory_order_acquire)) {
    wait_for_change(undone_, undone);
  }
}

void WorkerTeam::help() {
  std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
  while (ticket % kOneRound > 0) {
    const Call call = call_.load(std::memory_order_relaxed);
    const void* const work = work_.load(std::memory_order_relaxed);
    if (!ticket_.compare_exchange_weak(ticket, ticket - 1, std::memory_order_acq_rel, std::memory_order_acquire)) continue;
    call(work, static_cast<int>(ticket % kOneRound) - 1);
    if (undone_.fetch_sub(1, std::memory_order_acq_rel) == 1) undone_.notify_one();
    ticket = ticket_.load(std::memory_order_acquire);
  }
}

void WorkerTeam::wait_and_help() {
  for (;;) {
    const int round = round_.load();  // before the look whether all is over: the end is a round, too
    if (is_over_.load()) return;
    help();
    wait_for_change(round_, round);
  }
}

}  // namespace hydrostat::physics
