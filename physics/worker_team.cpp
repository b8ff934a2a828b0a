#include "physics/worker_team.h"

namespace hydrostat::physics {
namespace {

constexpr std::uint64_t kOneRound = std::uint64_t{1} << 32;
constexpr int kLooks = 200;  // of a helper for the next round, before it sleeps

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
  while (undone_.load(std::memory_order_acquire) > 0) std::this_thread::yield();
}

void WorkerTeam::help() {
  std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
  while (ticket % kOneRound > 0) {
    const Call call = call_.load(std::memory_order_relaxed);
    const void* const work = work_.load(std::memory_order_relaxed);
    if (!ticket_.compare_exchange_weak(ticket, ticket - 1, std::memory_order_acq_rel, std::memory_order_acquire)) continue;
    call(work, static_cast<int>(ticket % kOneRound) - 1);
    undone_.fetch_sub(1, std::memory_order_acq_rel);
    ticket = ticket_.load(std::memory_order_acquire);
  }
}

void WorkerTeam::wait_and_help() {
  int seen = 0;
  while (!is_over_.load()) {
    help();
    int round = round_.load(std::memory_order_acquire);
    for (int look = 0; round == seen && look < kLooks; ++look) {
      std::this_thread::yield();
      round = round_.load(std::memory_order_acquire);
    }
    if (round == seen) round_.wait(seen);
    seen = round_.load(std::memory_order_acquire);
  }
}

}  // namespace hydrostat::physics
