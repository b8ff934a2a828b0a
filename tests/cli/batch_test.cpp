#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "io/batch_results.h"
#include "tests/cli/run_program.h"

namespace hydrostat::cli::batch_test {
namespace {

namespace fs = std::filesystem;

/// A directory with a batch of four jobs, and in place of hydrostat a script that does what the clip's name says and keeps
/// count.
struct Workshop : TemporaryDirectory {
  Workshop() {
    io::write_file(path / "program", R"sh(#!/bin/sh
# convert CLIP -o OUT [options]
echo "$(basename "$2") $5 $6" >>runs
case "$(basename "$2")" in
  refused.fbx) echo "refused.fbx: has no skeleton. Give a clip with bones." >&2; exit 1 ;;
  usage.fbx) echo "hydrostat convert: option --limt: is not known. See --help." >&2; exit 2 ;;
  killed.fbx) kill -9 $$ ;;
esac
mkdir -p "$4"
warnings=$(cat "$2.warnings" 2>/dev/null)
echo "{\"replay\": {\"closed_loop\": {\"cycles\": 15}}, \"warnings\": [$warnings]}" >"$4/report.json"
[ "$(basename "$2")" != short.fbx ] || exit 3
)sh");
    fs::permissions(path / "program", fs::perms::owner_all);
    fs::create_directory(path / "elsewhere");
  }

  void manifest(const std::vector<std::string>& clips, const std::string& defaults = "") const {
    std::string text = "[defaults]\n" + defaults + "\n";
    for (const std::string& clip : clips) {
      text += "[[job]]\nclip = \"" + clip + ".fbx\"\nout = \"out/" + clip + "\"\n";
      if (!fs::exists(path / (clip + ".fbx"))) io::write_file(path / (clip + ".fbx"), clip);
    }
    io::write_file(path / "batch.toml", text);
  }

  /// Runs the batch from another directory than the manifest's.
  Outcome run(const std::string& options = "") const {
    return hydrostat_in(path / "elsewhere", "batch ../batch.toml --program ../program " + options);
  }

  std::vector<io::BatchResult> results() const { return io::read_batch_results(path / "batch.results.json"); }

  std::string runs() const { return fs::exists(path / "runs") ? io::read_file(path / "runs") : ""; }
};

TEST(Batch, IsDoneWhenEveryJobIs) {
  const Workshop workshop;
  workshop.manifest({"one", "two"}, "limit = 0.25\nthreads = 2\n");
  const Outcome outcome = workshop.run();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("batch: 2 jobs, 0 failed, see "), std::string::npos) << outcome.err;
  EXPECT_EQ(workshop.runs(), "one.fbx --limit=0.25 --threads=2\ntwo.fbx --limit=0.25 --threads=2\n");
  ASSERT_EQ(workshop.results().size(), 2U);
  EXPECT_EQ(workshop.results()[0].state, "done");
  EXPECT_EQ(workshop.results()[0].figures.at("cycles"), 15);
  EXPECT_TRUE(fs::exists(workshop.path / "batch.results.csv"));
}

TEST(Batch, TellsWhichJobsHadWarnings) {
  const Workshop workshop;
  workshop.manifest({"one", "two", "three"});
  io::write_file(workshop.path / "two.fbx.warnings", R"("it leans", "it floats")");
  io::write_file(workshop.path / "three.fbx.warnings", R"("it leans")");
  const Outcome outcome = workshop.run();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words : {"one: done\n", "two: done (2 warnings)\n", "three: done (1 warning)\n", "3 jobs, 0 failed, 2 with warnings, see "}) {
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << outcome.err;
  }
  EXPECT_EQ(workshop.results()[1].warnings, (std::vector<std::string>{"it leans", "it floats"}));
  EXPECT_NE(io::read_file(workshop.path / "batch.results.csv").find(",2,\"\"\r\n"), std::string::npos);
}

TEST(Batch, GoesOnPastJobsThatFail) {
  for (const char* jobs : {"1", "3"}) {
    SCOPED_TRACE(jobs);
    const Workshop workshop;
    workshop.manifest({"refused", "usage", "killed", "short", "one"});
    const Outcome outcome = workshop.run(std::string("--jobs ") + jobs);
    EXPECT_EQ(outcome.exit_code, 4);
    const std::vector<io::BatchResult> results = workshop.results();
    ASSERT_EQ(results.size(), 5U);
    EXPECT_EQ(results[0].state, "refused");
    EXPECT_EQ(results[0].message, "refused.fbx: has no skeleton. Give a clip with bones.");
    EXPECT_EQ(results[1].state, "usage");
    EXPECT_EQ(results[1].message, "../batch.toml: line 6: hydrostat convert: option --limt: is not known. See --help.");
    EXPECT_EQ(results[2].state, "crashed");
    EXPECT_EQ(results[2].exit_code, 137);
    EXPECT_EQ(results[2].message, "ended by signal 9 (Killed)");
    EXPECT_EQ(results[3].state, "short of target");
    EXPECT_EQ(results[3].exit_code, 3);
    EXPECT_EQ(results[4].state, "done");
    EXPECT_EQ(io::read_file(workshop.path / "out" / "refused.log"),
              "refused.fbx: has no skeleton. Give a clip with bones.\n");
  }
}

TEST(Batch, ResumesWithWhatIsNotDoneYet) {
  const Workshop workshop;
  workshop.manifest({"one", "refused", "short"});
  EXPECT_EQ(workshop.run().exit_code, 4);
  fs::remove(workshop.path / "runs");
  EXPECT_EQ(workshop.run("--resume").exit_code, 4);  // the one that fell short still does
  EXPECT_EQ(workshop.runs(), "refused.fbx  \n");
  EXPECT_EQ(workshop.results().size(), 3U);
  fs::remove(workshop.path / "runs");
  EXPECT_EQ(workshop.run().exit_code, 4);
  EXPECT_EQ(workshop.runs(), "one.fbx  \nrefused.fbx  \nshort.fbx  \n");
}

TEST(Batch, RedoesWhatWasMadeFromOtherClipsSettingsOrReports) {
  const Workshop workshop;
  workshop.manifest({"one", "two", "three"});
  EXPECT_EQ(workshop.run().exit_code, 0);
  fs::remove(workshop.path / "runs");
  io::write_file(workshop.path / "one.fbx", "another clip");
  io::write_file(workshop.path / "out" / "two" / "report.json", "{}");
  EXPECT_EQ(workshop.run("--resume").exit_code, 0);
  EXPECT_EQ(workshop.runs(), "one.fbx  \ntwo.fbx  \n");
  fs::remove(workshop.path / "runs");
  workshop.manifest({"one", "two", "three"}, "limit = 0.1");
  EXPECT_EQ(workshop.run("--resume").exit_code, 0);
  EXPECT_EQ(workshop.runs(), "one.fbx --limit=0.1 \ntwo.fbx --limit=0.1 \nthree.fbx --limit=0.1 \n");
}

TEST(Batch, PutsItsTableWhereItIsAskedToAndPrintsJson) {
  const Workshop workshop;
  workshop.manifest({"one"});
  const Outcome outcome = workshop.run("-o tables --json --quiet");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, io::read_file(workshop.path / "elsewhere" / "tables" / "batch.results.json"));
  EXPECT_FALSE(fs::exists(workshop.path / "batch.results.json"));
}

TEST(Batch, RefusesABadManifestWithFileLineAndMend) {
  const Workshop workshop;
  io::write_file(workshop.path / "batch.toml", "[[job]]\nclip = \"one.fbx\"\n");
  const Outcome outcome = workshop.run();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "../batch.toml: line 1: the job has no text 'out'. Add out = \"...\" below its [[job]].\n");
  EXPECT_EQ(workshop.runs(), "");
}

TEST(Batch, RefusesAMissingProgram) {
  const Workshop workshop;
  workshop.manifest({"one"});
  const Outcome outcome = hydrostat_in(workshop.path, "batch batch.toml --program ./none");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "./none: cannot be read. Check the path and the permission to read it.\n");
}

TEST(Batch, FailsAJobWhoseLogCannotBeWritten) {
  const Workshop workshop;
  workshop.manifest({"one"});
  io::write_file(workshop.path / "out", "in the way");
  const Outcome outcome = workshop.run();
  EXPECT_EQ(outcome.exit_code, 4);
  ASSERT_EQ(workshop.results().size(), 1U);
  EXPECT_EQ(workshop.results()[0].state, "refused");
  EXPECT_NE(workshop.results()[0].message.find("one.log: cannot be written: Not a directory. "), std::string::npos)
      << workshop.results()[0].message;
}

}  // namespace
}  // namespace hydrostat::cli::batch_test
