#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>

#include "cli/command_line.h"
#include "cli/place_option.h"
#include "cli/progress.h"
#include "io/batch_manifest.h"
#include "io/batch_results.h"
#include "io/fingerprint.h"
#include "io/write_file.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;
using io::BatchJob;
using io::BatchResult;

namespace {

struct BatchOptions {
  std::string manifest;
  std::string out;  // directory of the results; the manifest's own when empty
  std::string program = "/proc/self/exe";
  int jobs = 1;
  bool resume = false, json = false, quiet = false;
};

struct RunningJob {
  std::size_t index;
  std::chrono::steady_clock::time_point start;
};

fs::path log_of(const BatchJob& job) { return job.out.string() + ".log"; }

/// What the job's outcome depends on; files that options name count with their bytes.
std::string settings_of(const BatchJob& job, const std::string& program_sha256, const fs::path& directory) {
  io::Fingerprint fingerprint;
  fingerprint.add("program", program_sha256);
  const auto add_file = [&fingerprint](const fs::path& file) {
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) fingerprint.add("file", io::file_sha256(file));
  };
  fingerprint.add("clip", job.clip.string());
  add_file(job.clip);
  for (const std::string& option : job.options) {
    fingerprint.add("option", option);
    add_file(directory / option.substr(option.find('=') + 1));
  }
  return fingerprint.hex();
}

std::string report_sha256(const BatchJob& job) {
  const fs::path report = job.out / "report.json";
  return fs::is_regular_file(report) ? io::file_sha256(report) : "";
}

std::string last_line(const fs::path& file) {
  std::istringstream lines(fs::is_regular_file(file) ? io::read_file(file) : "");
  std::string last, line;
  while (std::getline(lines, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

std::string state_of(int exit_code) {
  switch (exit_code) {
    case kDone:
      return "done";
    case kInputRefused:
      return "refused";
    case kUsage:
      return "usage";
    case kShortOfTarget:
      return "short of target";
    default:
      return "crashed";
  }
}

/// To follow how a job ended.
std::string counted_warnings(std::size_t count) {
  if (count == 0) return "";
  return " (" + std::to_string(count) + (count == 1 ? " warning)" : " warnings)");
}

/// Starts 'PROGRAM convert CLIP -o OUT OPTIONS' in the manifest's directory, its output in the job's log. Throws Error.
pid_t start(const BatchJob& job, const std::string& program, const fs::path& directory) {
  const fs::path log = log_of(job);
  io::write_file(log, "");
  std::vector<std::string> words{program, "convert", job.clip.string(), "-o", job.out.string()};
  words.insert(words.end(), job.options.begin(), job.options.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_APPEND, 0);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
  pid_t child = 0;
  const int failure = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) throw Error(program, "", std::string("cannot be run: ") + std::strerror(failure), "Check the path.");
  return child;
}

/// Runs jobs side by side and keeps the results on the disk up to date, so that a killed batch can be resumed.
class Batch {
 public:
  Batch(const BatchOptions& options, std::vector<BatchJob> jobs)
      : options_(options),
        jobs_(std::move(jobs)),
        results_(jobs_.size()),
        directory_(fs::absolute(options.manifest).parent_path()),
        program_(fs::weakly_canonical(options.program).string()),
        progress_(std::cerr, progress_style(options.quiet)) {
    const fs::path place = options.out.empty() ? directory_ : fs::path(options.out);
    results_file_ = place / (fs::path(options.manifest).stem().string() + ".results");
    const std::string program_sha256 = io::file_sha256(options.program);
    for (const BatchJob& job : jobs_) settings_.push_back(settings_of(job, program_sha256, directory_));
  }
  ~Batch() {
    for (const auto& [child, job] : running_) waitpid(child, nullptr, 0);
  }

  std::vector<BatchResult> run() {
    if (options_.resume) take_over_earlier_results();
    progress_.begin("batch");
    for (std::size_t next = 0; next < jobs_.size() || !running_.empty();) {
      if (next < jobs_.size() && running_.size() < static_cast<std::size_t>(options_.jobs)) {
        if (!results_[next]) begin_job(next);
        ++next;
      } else {
        wait_for_one();
      }
    }
    save();
    const std::vector<BatchResult> all = finished();
    const auto failed = std::count_if(all.begin(), all.end(), [](const BatchResult& r) { return r.exit_code != 0; });
    const auto warned = std::count_if(all.begin(), all.end(), [](const BatchResult& r) { return !r.warnings.empty(); });
    progress_.end(std::to_string(all.size()) + " jobs, " + std::to_string(failed) + " failed, " +
                  (warned > 0 ? std::to_string(warned) + " with warnings, " : "") + "see " + results_file(".csv").string());
    return all;
  }

 private:
  fs::path results_file(const char* extension) const { return results_file_.string() + extension; }

  void take_over_earlier_results() {
    for (const BatchResult& earlier : io::read_batch_results(results_file(".json"))) {
      for (std::size_t j = 0; j < jobs_.size(); ++j) {
        if (earlier.report_sha256.empty() || earlier.out != jobs_[j].out.string() || earlier.settings != settings_[j])
          continue;
        if (earlier.report_sha256 == report_sha256(jobs_[j])) results_[j] = earlier;
      }
    }
  }

  void begin_job(std::size_t index) {
    try {
      const pid_t child = start(jobs_[index], program_, directory_);
      running_[child] = {index, std::chrono::steady_clock::now()};
    } catch (const Error& error) {
      finish_job(index, kInputRefused, 0, one_line(error));
    }
  }

  void wait_for_one() {
    int status = 0;
    const pid_t child = waitpid(-1, &status, 0);
    const auto found = running_.find(child);
    if (found == running_.end()) return;  // interrupted by a signal
    const auto [index, start_time] = found->second;
    running_.erase(found);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_time).count();
    if (WIFSIGNALED(status)) {
      const int number = WTERMSIG(status);
      finish_job(index, 128 + number, seconds, "ended by signal " + std::to_string(number) + " (" + strsignal(number) + ")");
    } else {
      const int exit_code = WEXITSTATUS(status);
      finish_job(index, exit_code, seconds, exit_code == kDone ? "" : last_line(log_of(jobs_[index])));
    }
  }

  void finish_job(std::size_t index, int exit_code, double seconds, std::string message) {
    const BatchJob& job = jobs_[index];
    if (exit_code == kUsage) message = options_.manifest + ": line " + std::to_string(job.line) + ": " + message;
    BatchResult result{job.name,
                       job.clip.string(),
                       job.out.string(),
                       state_of(exit_code),
                       exit_code,
                       seconds,
                       message,
                       settings_[index],
                       "",
                       {},
                       {}};
    if (exit_code == kDone || exit_code == kShortOfTarget) {  // otherwise what stands there is an older creature
      result.report_sha256 = report_sha256(job);
      result.figures = io::read_batch_figures(job.out);
      result.warnings = io::read_batch_warnings(job.out);
    }
    progress_.note(job.name + ": " + result.state + (message.empty() ? "" : ": " + message) + counted_warnings(result.warnings.size()));
    results_[index] = std::move(result);
    progress_.reach(static_cast<double>(finished().size()) / static_cast<double>(jobs_.size()));
    save();
  }

  std::vector<BatchResult> finished() const {
    std::vector<BatchResult> all;
    for (const std::optional<BatchResult>& result : results_) {
      if (result) all.push_back(*result);
    }
    return all;
  }

  void save() const {
    io::write_file(results_file(".csv"), io::batch_results_csv(finished()));
    io::write_file(results_file(".json"), io::batch_results_json(finished()));
  }

  const BatchOptions& options_;
  std::vector<BatchJob> jobs_;
  std::vector<std::string> settings_;
  std::vector<std::optional<BatchResult>> results_;
  fs::path directory_, results_file_;
  std::string program_;
  std::map<pid_t, RunningJob> running_;
  Progress progress_;
};

int run_batch(const BatchOptions& options) {
  const std::vector<BatchResult> results = Batch(options, io::read_batch_manifest(options.manifest)).run();
  if (options.json) std::cout << io::batch_results_json(results);
  const bool all_done =
      std::all_of(results.begin(), results.end(), [](const BatchResult& r) { return r.exit_code == kDone; });
  return all_done ? kDone : kSomeJobsFailed;
}

}  // namespace

void add_batch(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<BatchOptions>();
  CLI::App* batch = app.add_subcommand("batch", "Convert many clips; a clip that fails stops no other");
  batch->add_option("MANIFEST", options->manifest, "TOML file with [defaults] and a [[job]] for each clip")->required();
  batch->add_option("--jobs", options->jobs, "Conversions side by side")->check(CLI::Range(1, 256))->capture_default_str();
  batch->add_flag("--resume", options->resume,
                  "Skip jobs whose report is there and was made from the same clip and settings");
  batch->add_option("-o,--out", options->out, "Directory of the results table [the manifest's]")->check(refuse_no_place);
  batch->add_option("--program", options->program, "What runs the conversions")
      ->group("");  // tests put another in its place
  batch->add_flag("--json", options->json, "Print the results as JSON");
  batch->add_flag("--quiet", options->quiet, "No progress");
  batch->callback([options, &exit_code] { exit_code = run_batch(*options); });
}

}  // namespace hydrostat::cli
