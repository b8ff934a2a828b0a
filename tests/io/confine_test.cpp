#include "io/confine.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "io/import_worker.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::confine_test {
namespace {

const std::string kSamples = HYDROSTAT_SAMPLES;

bool opens(const std::string& path, int flags = O_RDONLY) {
  const int descriptor = open(path.c_str(), flags, 0600);
  if (descriptor >= 0) close(descriptor);
  return descriptor >= 0;
}

/// Runs something in a process of its own; returns its exit code.
template <typename Act>
int in_a_child(Act&& act) {
  const pid_t child = fork();
  if (child == 0) _exit(act());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(ConfineTo, LeavesTheNamedFileAndNothingElse) {
  const std::string written =
      (std::filesystem::temp_directory_path() / ("hydrostat_confine_" + std::to_string(getpid()))).string();
  const int outcome = in_a_child([&] {
    const std::string file = kSamples + "/boxdog_trot.fbx";
    const Confinement confinement = confine_to(file);
    if (!confinement.files) return 77;
    if (!opens(file)) return 1;
    if (opens(kSamples + "/worm_crawl.glb")) return 2;
    if (opens("/etc/passwd")) return 3;
    if (opens(written, O_WRONLY | O_CREAT)) return 4;
    return 0;
  });
  EXPECT_FALSE(std::filesystem::exists(written));
  if (outcome == 77) GTEST_SKIP() << "the kernel has no Landlock, or a sanitizer is on";
  EXPECT_EQ(outcome, 0);
}

TEST(ConfineTo, LeavesForGltfWhatLiesBesideIt) {
  const int outcome = in_a_child([&] {
    if (!confine_to(kSamples + "/worm_crawl.glb").files) return 77;
    if (!opens(kSamples + "/README.md")) return 1;
    return opens("/etc/passwd") ? 2 : 0;
  });
  if (outcome == 77) GTEST_SKIP() << "the kernel has no Landlock, or a sanitizer is on";
  EXPECT_EQ(outcome, 0);
}

TEST(ConfineTo, ClosesTheNetworkAndOtherPrograms) {
  const int outcome = in_a_child([&] {
    if (!confine_to(kSamples + "/worm_crawl.glb").network) return 77;
    if (socket(AF_INET, SOCK_STREAM, 0) >= 0 || errno != EACCES) return 1;
    const char* const argv[] = {"true", nullptr};
    execv("/bin/true", const_cast<char**>(argv));
    if (errno != EACCES) return 2;
    return kill(getppid(), 0) == 0 ? 3 : 0;
  });
  if (outcome == 77) GTEST_SKIP() << "no seccomp, or a sanitizer is on";
  EXPECT_EQ(outcome, 0);
}

TEST(EndWithParent, EndsWhenTheParentIsKilled) {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // the orphan becomes ours
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    const pid_t self = getpid();
    if (fork() == 0) {
      end_with_parent(self);
      const pid_t orphan = getpid();
      if (write(ends[1], &orphan, sizeof orphan) != sizeof orphan) _exit(1);
      sleep(5);
      _exit(0);
    }
    sleep(5);
    _exit(0);
  }
  pid_t orphan = 0;
  ASSERT_EQ(read(ends[0], &orphan, sizeof orphan), static_cast<ssize_t>(sizeof orphan));
  kill(parent, SIGKILL);
  int status = 0;
  waitpid(parent, &status, 0);
  EXPECT_EQ(waitpid(orphan, &status, 0), orphan);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  prctl(PR_SET_CHILD_SUBREAPER, 0);
  close(ends[0]);
  close(ends[1]);
}

TEST(ReadInWorker, LeavesNoZombieAndIsCheapOnASmallFile) {
  set_import_worker_executable((std::filesystem::path(HYDROSTAT_BINARY).parent_path() / "hydrostat-import").string());
  double least_s = 1;
  for (int i = 0; i < 5; ++i) {
    ReadCost cost;
    read_in_worker(kSamples + "/worm_crawl.glb", {}, &cost);
    least_s = std::min(least_s, cost.cpu_s);
  }
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
  EXPECT_LT(least_s, 0.05);
  set_import_worker_executable(HYDROSTAT_BINARY);
}

/// One turning bone; each frame takes 12 bytes of text.
void write_long_bvh(const std::string& path, int frames) {
  std::ofstream file(path);
  file << "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
          "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: "
       << frames << "\nFrame Time: 0.01\n";
  for (int frame = 0; frame < frames; ++frame) file << "0.5 0.5 0.5\n";
}

TEST(ReadInWorker, IsRefusedPastItsMemory) {
  const TemporaryDirectory directory;
  const std::string path = (directory.path / "long.bvh").string();
  write_long_bvh(path, 500000);
  ReadLimits limits;
  limits.memory_gib = 0.05;
  const std::string said = refusal([&] { read_in_worker(path, limits); });
  EXPECT_NE(said.find("takes more than 0.05 GiB of memory"), std::string::npos) << said;
  EXPECT_NE(said.find("--import-memory"), std::string::npos) << said;
}

}  // namespace
}  // namespace hydrostat::io::confine_test
