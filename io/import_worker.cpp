#include "io/import_worker.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>

#include "io/confine.h"
#include "io/read_scene.h"
#include "io/scene_wire.h"

namespace hydrostat::io {
namespace {

constexpr const char* kWorkerArgument = "--import-worker";
constexpr const char* kWorkerMark = "HYDROSTAT_IMPORT_WORKER";  // set in the worker's environment
constexpr int kAnswerDescriptor = 3;
constexpr std::uintmax_t kFileLimit = std::uintmax_t{1} << 30;  // [bytes]

/// 'hydrostat-import' beside the running program, or else the running program itself.
std::string default_worker() {
  std::error_code failure;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", failure);
  const std::filesystem::path small = self.parent_path() / "hydrostat-import";
  return !failure && access(small.c_str(), X_OK) == 0 ? small.string() : "/proc/self/exe";
}

std::string& worker_executable() {
  static std::string path = default_worker();
  return path;
}

double bytes_of(const ReadLimits& limits) { return limits.memory_gib * 0x1p30; }

std::string number_text(double number, const char* unit) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g %s", number, unit);
  return text.data();
}

Error too_large(const std::string& path, double memory_gib) {
  return {path, "import", "reading it takes more than " + number_text(memory_gib, "GiB") + " of memory",
          "Export the file anew, with less in it, or give a larger --import-memory"};
}

WorkerAnswer read_or_say_why(const std::string& path, const Confinement& confinement, double memory_gib) {
  try {
    Scene scene = read_scene(path);
    scene.files_confined = confinement.files;
    scene.network_confined = confinement.network;
    return scene;
  } catch (const Error& error) {
    // assimp catches what is thrown and keeps its text.
    const bool memory = std::string_view(error.what()).find("bad_alloc") != std::string_view::npos;
    return memory ? too_large(path, memory_gib) : error;
  } catch (const std::bad_alloc&) {
    return too_large(path, memory_gib);
  } catch (const std::exception& error) {
    return Error(path, "import", std::string("it cannot be read (") + error.what() + ")", "Export the file anew");
  }
}

bool write_all(int descriptor, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = write(descriptor, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

/// Closes a descriptor, and ends and reaps a process, whichever way the scope is left.
struct Descriptor {
  int value = -1;
  void close_now() {
    if (value >= 0) close(value);
    value = -1;
  }
  ~Descriptor() { close_now(); }
};
struct Child {
  pid_t pid = -1;
  rusage used{};
  int wait_for_end() {
    int status = 0;
    while (wait4(pid, &status, 0, &used) < 0 && errno == EINTR) {
    }
    pid = -1;
    return status;
  }
  ~Child() {
    if (pid <= 0) return;
    kill(pid, SIGKILL);
    wait_for_end();
  }
};

/// The worker's environment: ours and the mark.
std::vector<std::string> marked_environment() {
  std::vector<std::string> entries;
  for (char** entry = environ; *entry != nullptr; ++entry) entries.emplace_back(*entry);
  entries.push_back(std::string(kWorkerMark) + "=1");
  return entries;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  for (std::string& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

pid_t start_worker(const std::string& path, const ReadLimits& limits, int answer_descriptor) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // What the libraries print (failed asserts, above all) is not for the user.
  posix_spawn_file_actions_adddup2(&actions, answer_descriptor, kAnswerDescriptor);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> arguments{"hydrostat-import",
                                     kWorkerArgument,
                                     path,
                                     number_text(limits.memory_gib, ""),
                                     number_text(std::ceil(limits.time_s) + 1, ""),
                                     std::to_string(getpid())};
  std::vector<std::string> environment = marked_environment();
  pid_t pid = -1;
  const int failure = posix_spawn(&pid, worker_executable().c_str(), &actions, nullptr, pointers(arguments).data(),
                                  pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) {
    throw Error(path, "import", std::string("the reading process cannot be started (") + std::strerror(failure) + ")",
                "See that this machine has memory and processes left");
  }
  return pid;
}

/// Reads until the other end closes. Throws Error after the time limit, and past half of the memory limit: what is read is
/// held twice.
std::string read_answer(int descriptor, const std::string& path, const ReadLimits& limits) {
  using Seconds = std::chrono::duration<double>;
  const auto start = std::chrono::steady_clock::now();
  std::string bytes;
  std::array<char, 1 << 16> block;
  while (true) {
    const double left_s = limits.time_s - Seconds(std::chrono::steady_clock::now() - start).count();
    pollfd waited{descriptor, POLLIN, 0};
    const int ready = left_s > 0 ? poll(&waited, 1, static_cast<int>(std::ceil(1000 * left_s))) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) throw too_slow(path, limits.time_s);
    const ssize_t got = read(descriptor, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(got));
    if (2 * static_cast<double>(bytes.size()) > bytes_of(limits)) throw too_large(path, limits.memory_gib);
  }
}

void require_readable_file(const std::string& path) {
  std::error_code failure;
  const std::filesystem::file_status status = std::filesystem::status(path, failure);
  if (!std::filesystem::exists(status)) throw Error(path, "file", "there is no such file", "Check the path");
  if (!std::filesystem::is_regular_file(status))
    throw Error(path, "file", "it is not a file", "Give the path of a clip file");
  if (access(path.c_str(), R_OK) != 0) {
    throw Error(path, "file", std::string("it cannot be opened (") + std::strerror(errno) + ")", "Make the file readable");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, failure);
  if (size == 0) throw Error(path, "file", "it is empty", "Export the file anew");
  if (size > kFileLimit) throw Error(path, "file", "it is larger than 1 GiB", "Export the character alone");
}

}  // namespace

Error too_slow(const std::string& path, double time_s) {
  return {path, "import", "reading it takes longer than " + number_text(time_s, "s"),
          "Cut polygons of very many corners into triangles and export the file anew, or give a longer --import-timeout"};
}

std::optional<int> run_import_worker(int argc, char** argv) {
  if (argc != 6 || std::string_view(argv[1]) != kWorkerArgument) return std::nullopt;
  const std::string path = argv[2];
  const double memory_gib = std::strtod(argv[3], nullptr);
  end_with_parent(std::atoi(argv[5]));
  limit_resources(static_cast<unsigned long long>(memory_gib * 0x1p30),
                  static_cast<unsigned>(std::strtod(argv[4], nullptr)));
  const Confinement confinement = confine_to(path);
  return write_all(kAnswerDescriptor, to_bytes(read_or_say_why(path, confinement, memory_gib))) ? 0 : 1;
}

void set_import_worker_executable(const std::string& path) { worker_executable() = path; }

Scene read_in_worker(const std::string& path, const ReadLimits& limits, ReadCost* cost) {
  const auto start = std::chrono::steady_clock::now();
  require_readable_file(path);
  // A program that forgot run_import_worker() would start itself without end.
  if (std::getenv(kWorkerMark) != nullptr) {
    throw Error(path, "import", "a reading process was asked to start another", "Call run_import_worker() first in main()");
  }
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(path, "import", std::string("no pipe can be opened (") + std::strerror(errno) + ")", "Close other programs");
  }
  Descriptor reading{ends[0]}, writing{ends[1]};
  Child worker{start_worker(path, limits, writing.value)};
  writing.close_now();
  const std::string bytes = read_answer(reading.value, path, limits);
  const int status = worker.wait_for_end();
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) throw too_slow(path, limits.time_s);
  if (WIFSIGNALED(status)) {
    throw Error(path, "import", std::string("the file brings its reader down (") + strsignal(WTERMSIG(status)) + ")",
                "Export the file anew, or in the other format of FBX and glTF");
  }
  try {
    WorkerAnswer answer = from_bytes(bytes);
    if (cost) {
      const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
      };
      cost->wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      cost->cpu_s = seconds(worker.used.ru_utime) + seconds(worker.used.ru_stime);
      cost->peak_mib = static_cast<double>(worker.used.ru_maxrss) / 1024;
    }
    if (const Error* error = std::get_if<Error>(&answer)) throw Error(*error);
    return std::get<Scene>(std::move(answer));
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(path, "import", std::string("what was read does not hold together (") + error.what() + ")",
                "Export the file anew");
  }
}

}  // namespace hydrostat::io
