#include "io/batch_manifest.h"

#include <gtest/gtest.h>

#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::batch_manifest_test {
namespace {

using Words = std::vector<std::string>;

std::vector<BatchJob> jobs_of(const TemporaryDirectory& directory, const std::string& text) {
  write_file(directory.path / "batch.toml", text);
  return read_batch_manifest(directory.path / "batch.toml");
}

/// "where|what|mend" of the refusal of a manifest.
std::string refusal_of(const std::string& text) {
  const TemporaryDirectory directory;
  const std::string told = refusal([&] { jobs_of(directory, text); });
  const std::string file = (directory.path / "batch.toml").string() + "|";
  EXPECT_EQ(told.find(file), 0U) << told;
  return told.substr(file.size());
}

TEST(BatchManifest, ReadsJobsWithTheirOptions) {
  const TemporaryDirectory directory;
  const std::vector<BatchJob> jobs = jobs_of(directory, R"(
[defaults]
threads = 1
limit = 0.25
quiet = true

[[job]]
clip = "clips/trot.fbx"
out = "out/trot/"

[[job]]
clip = "/clips/fox.glb"
out = "out/fox"
name = "the fox"
clip_name = "Walk"
limit = "auto"
quiet = false
root_motion = "feet"
export = ["pc2", "obj"]
)");
  ASSERT_EQ(jobs.size(), 2U);
  EXPECT_EQ(jobs[0].name, "trot");
  EXPECT_EQ(jobs[0].clip, directory.path / "clips" / "trot.fbx");
  EXPECT_EQ(jobs[0].out, directory.path / "out" / "trot");
  EXPECT_EQ(jobs[0].line, 7);
  EXPECT_EQ(jobs[0].options, (Words{"--limit=0.25", "--quiet", "--threads=1"}));
  EXPECT_EQ(jobs[1].name, "the fox");
  EXPECT_EQ(jobs[1].clip, "/clips/fox.glb");
  EXPECT_EQ(jobs[1].options,
            (Words{"--clip=Walk", "--export=pc2", "--export=obj", "--limit=auto", "--root-motion=feet", "--threads=1"}));
}

TEST(BatchManifest, NamesTheLineOfWhatIsWrong) {
  const std::string job = "[[job]]\nclip = \"a.fbx\"\nout = \"a\"\n";
  const std::string broken = refusal_of(job + "limit = = 3\n");
  EXPECT_EQ(broken.find("line 4|"), 0U) << broken;
  EXPECT_NE(broken.find("|Mend the TOML of that line."), std::string::npos) << broken;
  EXPECT_EQ(refusal_of(""), "|holds no job|Add [[job]] with clip = \"...\" and out = \"...\".");
  EXPECT_EQ(refusal_of("[[job]]\nout = \"a\"\n"), "line 1|the job has no text 'clip'|Add clip = \"...\" below its [[job]].");
  EXPECT_EQ(refusal_of("[[job]]\nclip = \"a\"\nout = 3\n"),
            "line 3|the job has no text 'out'|Add out = \"...\" below its [[job]].");
  EXPECT_EQ(refusal_of("[[jobs]]\nclip = \"a\"\n"), "line 1|'jobs' is not known|A manifest holds [defaults] and [[job]].");
  EXPECT_EQ(
      refusal_of(job + "limit = {}\n"),
      "line 4|'limit' has no value that an option can take|Give it a number, a text, true or false, or a list of numbers or "
      "texts.");
  EXPECT_EQ(refusal_of("[defaults]\nout = \"a\"\n" + job), "line 2|[defaults] cannot give 'out'|Give it in each [[job]].");
  EXPECT_EQ(refusal_of("defaults = 1\n" + job), "line 1|'defaults' is not a table|Write [defaults].");
  EXPECT_EQ(refusal_of("job = [1]\n"), "line 1|a job is not a table|Write [[job]] on a line of its own.");
  EXPECT_EQ(refusal_of(job + "[[job]]\nclip = \"b.fbx\"\nout = \"./a/\"\n"),
            "line 4|the job writes to the same 'out' as the job of line 1|Give each job an 'out' of its own.");
}

TEST(BatchManifest, IsRefusedWhenItIsMissing) {
  EXPECT_EQ(refusal([] { read_batch_manifest("/none/batch.toml"); }),
            "/none/batch.toml||cannot be read|Check the path and the permission to read it.");
}

}  // namespace
}  // namespace hydrostat::io::batch_manifest_test
