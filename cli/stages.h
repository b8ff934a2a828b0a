#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/progress.h"
#include "io/stage_records.h"

namespace hydrostat::cli {

/// Runs stages one after the other, or takes their results from the cache, and keeps the time.
class Stages {
 public:
  explicit Stages(Progress& progress) : progress_(progress) {}

  std::vector<std::pair<std::string, double>> timing_s;

  void use_cache(const std::filesystem::path& directory) { cache_.emplace(directory); }

  const io::StageCache& cache() const { return *cache_; }

  template <typename Make>
  auto run(const std::string& name, const Make& make) {
    progress_.begin(name);
    const auto began = std::chrono::steady_clock::now();
    auto result = make();
    progress_.end(outcome_);
    outcome_.clear();
    timing_s.emplace_back(name, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
    return result;
  }
  /// The result is looked for in the cache under `key` and kept there.
  template <typename Make>
  auto run(const std::string& name, const std::string& key, const Make& make) {
    using Result = decltype(make());
    return run(name, [&]() -> Result {
      if (const std::optional<io::Record> record = cache_->load(name, key)) {
        outcome_ = "from the cache";
        return io::result_of<Result>(*record);
      }
      Result result = make();
      cache_->store(name, key, io::record_of(result));
      return result;
    });
  }

 private:
  Progress& progress_;
  std::optional<io::StageCache> cache_;
  std::string outcome_;
};

}  // namespace hydrostat::cli
