#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace hydrostat::physics {

/// Threads that share out one piece of work after another. Which of them does which part is left to chance: a part must not
/// hang on another, nor on who does it.
class WorkerTeam {
 public:
  /// The caller of `share` is one of the `threads`; of one there is nobody to wake.
  explicit WorkerTeam(int threads);
  ~WorkerTeam();
  WorkerTeam(const WorkerTeam&) = delete;
  WorkerTeam& operator=(const WorkerTeam&) = delete;

  /// Calls work(part) once for each part from 0 to `parts` - 1, side by side, and returns when all are done. Allocates
  /// nothing; `work` must not throw.
  template <class Work>
  void share(int parts, const Work& work) {
    run(
        parts, [](const void* of, int part) { (*static_cast<const Work*>(of))(part); }, &work);
  }

 private:
  using Call = void (*)(const void*, int);
  void run(int parts, Call call, const void* work);
  void wait_and_help();
  void help();

  // A round of work is over before the next one is laid out. The ticket holds the number of the round and the parts that
  // nobody has taken: whoever lowers it has taken a part of that very round, whose call and work he has read before.
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<Call> call_{nullptr};
  std::atomic<const void*> work_{nullptr};
  std::atomic<int> undone_{0};
  std::atomic<int> round_{0};
  std::atomic<bool> is_over_{false};
  std::vector<std::thread> helpers_;
};

}  // namespace hydrostat::physics
