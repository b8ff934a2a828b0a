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
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>

#include "io/read_scene.h"
#include "io/scene_wire.h"

namespace hydrostat::io {
namespace {

constexpr const char* kWorkerArgument = "--import-worker";
constexpr const char* kWorkerMark = "HYDROSTAT_IMPORT_WORKER";  // set in the worker's environment
constexpr int kAnswerDescriptor = 3;
constexpr rlim_t kMemoryLimit = rlim_t{3} << 30;                // [bytes]
constexpr std::size_t kAnswerLimit = std::size_t{1} << 30;      // [bytes]
constexpr std::uintmax_t kFileLimit = std::uintmax_t{1} << 30;  // [bytes]

std::string& worker_executable() {
  static std::string path = "/proc/self/exe";
  return path;
}

// A sanitizer reserves terabytes of address space, so the two exclude each other.
constexpr bool kSanitized =
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
    true;
#else
    false;
#endif
#else
    false;
#endif

void limit_resources() {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  if (kSanitized) return;
  const rlimit memory{kMemoryLimit, kMemoryLimit};
  setrlimit(RLIMIT_AS, &memory);
}

WorkerAnswer read_or_say_why(const std::string& path) {
  try {
    return read_scene(path);
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return Error(path, "import", "reading it takes more than 3 GiB of memory", "Export the file anew, with less in it");
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
  int wait_for_end() {
    int status = 0;
    while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
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

pid_t start_worker(const std::string& path, int answer_descriptor) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // What the libraries print (failed asserts, above all) is not for the user.
  posix_spawn_file_actions_adddup2(&actions, answer_descriptor, kAnswerDescriptor);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> arguments{"hydrostat", kWorkerArgument, path};
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

std::string seconds_text(std::chrono::milliseconds time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g s", static_cast<double>(time.count()) / 1000);
  return text.data();
}

/// Reads until the other end closes. Throws Error after the time limit or past the size limit.
std::string read_answer(int descriptor, const std::string& path, std::chrono::milliseconds time_limit) {
  const auto deadline = std::chrono::steady_clock::now() + time_limit;
  std::string bytes;
  std::array<char, 1 << 16> block;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd waited{descriptor, POLLIN, 0};
    const int ready = left.count() > 0 ? poll(&waited, 1, static_cast<int>(left.count())) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) {
      throw Error(path, "import", "reading it takes longer than " + seconds_text(time_limit),
                  "Cut polygons of very many corners into triangles and export the file anew");
    }
    const ssize_t got = read(descriptor, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(got));
    if (bytes.size() > kAnswerLimit) {
      throw Error(path, "import", "its meshes and keys fill more than 1 GiB", "Export the file anew, with less in it");
    }
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

std::optional<int> run_import_worker(int argc, char** argv) {
  if (argc != 3 || std::string_view(argv[1]) != kWorkerArgument) return std::nullopt;
  limit_resources();
  return write_all(kAnswerDescriptor, to_bytes(read_or_say_why(argv[2]))) ? 0 : 1;
}

void set_import_worker_executable(const std::string& path) { worker_executable() = path; }

Scene read_in_worker(const std::string& path, std::chrono::milliseconds time_limit) {
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
  Child worker{start_worker(path, writing.value)};
  writing.close_now();
  const std::string bytes = read_answer(reading.value, path, time_limit);
  const int status = worker.wait_for_end();
  if (WIFSIGNALED(status)) {
    throw Error(path, "import", std::string("the file brings its reader down (") + strsignal(WTERMSIG(status)) + ")",
                "Export the file anew, or in the other format of FBX and glTF");
  }
  try {
    WorkerAnswer answer = from_bytes(bytes);
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
