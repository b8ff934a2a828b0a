#include "io/confine.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <strings.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

// A sanitizer reserves terabytes of address space and reads files of the system at its end.
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

// The C library has no wrappers, and the header of an older kernel lacks the later rights; their bits are the kernel's
// interface.
constexpr std::uint64_t kFirstRights = (std::uint64_t{1} << 13) - 1;  // execute, write, read, make, remove
constexpr std::uint64_t kRefer = std::uint64_t{1} << 13, kTruncate = std::uint64_t{1} << 14, kIoctl = std::uint64_t{1} << 15;
constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE;

bool may_read(int ruleset, const fs::path& place, std::uint64_t rights) {
  const int descriptor = open(place.c_str(), O_PATH | O_CLOEXEC);
  if (descriptor < 0) return false;
  landlock_path_beneath_attr rule{};
  rule.allowed_access = rights;
  rule.parent_fd = descriptor;
  const bool added = syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
  close(descriptor);
  return added;
}

bool has_files_beside_it(const fs::path& file) {
  const std::string extension = file.extension().string();
  for (const char* known : {".gltf", ".glb", ".obj"}) {
    if (strcasecmp(extension.c_str(), known) == 0) return true;
  }
  return false;
}

/// Source: Linux, Documentation/userspace-api/landlock.rst.
bool confine_files(const fs::path& file) {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return false;  // an older kernel, or one that has it switched off
  landlock_ruleset_attr handled{};
  handled.handled_access_fs =
      kFirstRights | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0) | (version >= 5 ? kIoctl : 0);
  const int ruleset = static_cast<int>(syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0));
  if (ruleset < 0) return false;
  bool done = may_read(ruleset, file, kRead);
  const fs::path beside = fs::absolute(file).parent_path();
  if (done && has_files_beside_it(file) && beside != beside.root_path())
    done = may_read(ruleset, beside, kRead | LANDLOCK_ACCESS_FS_READ_DIR);
  done = done && syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
  close(ruleset);
  return done;
}

bool confine_calls() {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
  if (filter == nullptr) return false;
  bool done = true;
  for (const int call : {SCMP_SYS(socket),
                         SCMP_SYS(socketpair),
                         SCMP_SYS(connect),
                         SCMP_SYS(bind),
                         SCMP_SYS(listen),
                         SCMP_SYS(accept),
                         SCMP_SYS(accept4),
                         SCMP_SYS(sendto),
                         SCMP_SYS(sendmsg),
                         SCMP_SYS(sendmmsg),
                         SCMP_SYS(io_uring_setup),
                         SCMP_SYS(execve),
                         SCMP_SYS(execveat),
                         SCMP_SYS(fork),
                         SCMP_SYS(vfork),
                         SCMP_SYS(clone),
                         SCMP_SYS(clone3),
                         SCMP_SYS(kill),
                         SCMP_SYS(ptrace),
                         SCMP_SYS(process_vm_readv),
                         SCMP_SYS(process_vm_writev),
                         SCMP_SYS(pidfd_open)}) {
    done = seccomp_rule_add(filter, SCMP_ACT_ERRNO(EACCES), call, 0) == 0 && done;
  }
  done = done && seccomp_load(filter) == 0;
  seccomp_release(filter);
  return done;
}

void set_limit(decltype(RLIMIT_AS) which, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(which, &limit);
}

}  // namespace

Confinement confine_to(const std::string& file) {
  if (kSanitized || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {};
  Confinement confinement;
  confinement.files = confine_files(file);
  confinement.network = confine_calls();
  return confinement;
}

void limit_resources(unsigned long long memory_bytes, unsigned time_s) {
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_FSIZE, 0);
  set_limit(RLIMIT_CPU, time_s);
  if (!kSanitized) set_limit(RLIMIT_AS, memory_bytes);
}

void end_with_parent(int parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(EXIT_FAILURE);  // it ended before we asked
}

}  // namespace hydrostat::io
