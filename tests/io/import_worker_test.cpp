#include "io/import_worker.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "retarget/error.h"

namespace hydrostat::io::import_worker_test {
namespace {

const std::string kClip = std::string(HYDROSTAT_SAMPLES) + "/worm_crawl.glb";

/// Reads a sound clip with a shell script in the place of the worker; returns what the Error says.
std::string complaint_with_worker(const std::string& script) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("hydrostat_worker_" + std::to_string(getpid()));
  std::ofstream(path) << "#!/bin/sh\n" << script << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  set_import_worker_executable(path.string());
  std::string complaint;
  try {
    read_in_worker(kClip, {.time_s = 0.3});
  } catch (const Error& error) {
    EXPECT_EQ(error.file, kClip);
    EXPECT_FALSE(error.mend.empty());
    complaint = error.what();
  }
  set_import_worker_executable(HYDROSTAT_BINARY);
  std::filesystem::remove(path);
  return complaint;
}

TEST(ReadInWorker, GivesTheScene) {
  set_import_worker_executable(HYDROSTAT_BINARY);
  EXPECT_EQ(read_in_worker(kClip).clips.size(), 1u);
}

TEST(ReadInWorker, AWorkerThatDiesIsAnError) {
  EXPECT_NE(complaint_with_worker("kill -SEGV $$").find("brings its reader down (Segmentation fault)"), std::string::npos);
  EXPECT_NE(complaint_with_worker("kill -ABRT $$").find("brings its reader down (Aborted)"), std::string::npos);
}

TEST(ReadInWorker, AWorkerThatHangsIsEndedAfterTheTimeLimit) {
  EXPECT_NE(complaint_with_worker("exec sleep 30").find("takes longer than 0.3 s"), std::string::npos);
}

TEST(ReadInWorker, AWorkerThatAnswersNonsenseIsAnError) {
  EXPECT_NE(complaint_with_worker("echo nonsense >&3").find("does not hold together"), std::string::npos);
  EXPECT_NE(complaint_with_worker("exit 0").find("does not hold together"), std::string::npos);
}

TEST(ReadInWorker, AWorkerThatCannotBeStartedIsAnError) {
  set_import_worker_executable("/no/such/program");
  EXPECT_THROW(read_in_worker(kClip), Error);
  set_import_worker_executable(HYDROSTAT_BINARY);
}

}  // namespace
}  // namespace hydrostat::io::import_worker_test
