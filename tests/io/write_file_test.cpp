#include "io/write_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "io/writable.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::write_file_test {
namespace {

/// Files of this process end at `bytes`, as on a disk that is full.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

TEST(WriteFile, GivesTheBytesBackAndLeavesNoPart) {
  const TemporaryDirectory directory;
  const std::string bytes("a\0b\n", 4);
  write_file(directory.path / "file", "older and longer than the new content");
  write_file(directory.path / "file", bytes);
  EXPECT_EQ(read_file(directory.path / "file"), bytes);
  EXPECT_EQ(directory.count(), 1U);
}

TEST(WriteFile, LeavesTheOldFileWhenTheDiskIsFull) {
  const TemporaryDirectory directory;
  write_file(directory.path / "file", "old");
  std::string told;
  {
    const FileSizeLimit limit(1000);
    told = refusal([&] { write_file(directory.path / "file", std::string(5000, 'x'), "creature/file"); });
  }
  EXPECT_EQ(
      told,
      "creature/file||cannot be written: File too large|Raise the limit on file sizes (ulimit -f), or write elsewhere.");
  EXPECT_EQ(read_file(directory.path / "file"), "old");
  EXPECT_EQ(directory.count(), 1U);
}

TEST(WriteFile, RefusesAFileWhereADirectoryIsNeeded) {
  const TemporaryDirectory directory;
  write_file(directory.path / "file", "");
  const std::string told = refusal([&] { write_file(directory.path / "file" / "inner", "x"); });
  EXPECT_NE(told.find("cannot be written: Not a directory|A file stands where a directory is needed"), std::string::npos)
      << told;
}

TEST(WriteFile, RefusesADirectoryWhereTheFileBelongs) {
  const TemporaryDirectory directory;
  std::filesystem::create_directories(directory.path / "file" / "inner");
  const std::string told = refusal([&] { write_file(directory.path / "file", "x"); });
  EXPECT_NE(told.find("Is a directory|A directory stands where the file belongs"), std::string::npos) << told;
  EXPECT_EQ(directory.count(), 1U);
}

TEST(RefuseUnwritable, LeavesNothingAndRefusesLikeTheFilesThatWouldCome) {
  const TemporaryDirectory directory;
  refuse_unwritable(directory.path / "a" / "b");
  refuse_unwritable(directory.path / "a" / "b" / "");
  EXPECT_TRUE(std::filesystem::is_empty(directory.path));
  std::filesystem::create_directory(directory.path / "a");
  refuse_unwritable(directory.path / "a" / "b");
  EXPECT_EQ(directory.count(), 1U);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path / "a"));
  std::filesystem::remove(directory.path / "a");
  std::filesystem::create_symlink(directory.path / "nowhere" / "at_all", directory.path / "link");
  EXPECT_NE(refusal([&] { refuse_unwritable(directory.path / "link"); }), "");
  EXPECT_TRUE(std::filesystem::is_symlink(directory.path / "link"));
  write_file(directory.path / "file", "");
  refuse_unwritable_file(directory.path / "file");
  EXPECT_EQ(refusal([&] { refuse_unwritable_file(directory.path); }), refusal([&] { write_file(directory.path, "x"); }));
  for (const std::filesystem::path& place : {directory.path / "file", directory.path / "file" / "a" / "b", std::filesystem::path("/proc/out")}) {
    const std::string told = refusal([&] { refuse_unwritable(place); });
    EXPECT_TRUE(told.starts_with(place.string() + "||cannot be written: ")) << told;
    const std::string later = refusal([&] { write_file(place / "table.csv", "x"); });
    EXPECT_EQ(told.substr(place.string().size()), later.substr((place / "table.csv").string().size()));
  }
}

TEST(ReadFile, RefusesWhatIsMissingOrADirectory) {
  const TemporaryDirectory directory;
  for (const std::filesystem::path& path : {directory.path, directory.path / "none"}) {
    EXPECT_EQ(refusal([&] { read_file(path); }),
              path.string() + "||cannot be read|Check the path and the permission to read it.");
  }
}

}  // namespace
}  // namespace hydrostat::io::write_file_test
