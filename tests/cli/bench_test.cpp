#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/bench.h"
#include "io/scaling_page.h"
#include "retarget/effect_bench.h"
#include "tests/cli/run_program.h"

namespace hydrostat::cli::bench_test {
namespace {

namespace fs = std::filesystem;

TEST(Bench, ScalingTellsTheCostOfEverySizeInTableAndPage) {
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(directory.path, "bench scaling - -o out --largest 500 --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["schema"], "hydrostat.scaling/1");
  ASSERT_EQ(json["rows"].size(), 2U);
  EXPECT_GT(json["rows"][1]["elements"], json["rows"][0]["elements"]);
  for (const auto& row : json["rows"]) {
    EXPECT_TRUE(row["whole"]);
    for (const char* key : {"cpu_ns", "one_thread_ns", "shared_ns", "bytes", "substeps_per_s"})
      EXPECT_GT(row[key], 0) << key;
    // Slower than any limit of the machine, were it ever so loaded, and not by three orders.
    EXPECT_GT(row["cpu_ns"], row["arithmetic_limit_ns"]);
    EXPECT_LT(row["cpu_ns"], 1000 * row["arithmetic_limit_ns"].get<double>());
  }
  const std::string csv = io::read_file(directory.path / "out" / "scaling.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
  EXPECT_NE(io::read_file(directory.path / "out" / "scaling.html").find("<svg"), std::string::npos);
  EXPECT_TRUE(fs::exists(directory.path / "out" / "scene.toml"));  // what '-' stands for
}

TEST(Bench, EffectsThatDivergeStillFillOneLine) {
  EXPECT_EQ(effect_line({"gravity", 1.5, 0.02, true, 0, 12.25, 0.4}),
            "gravity           1.500 ms a second, moves it by    2.000 % L; all others:    12.250 ms,   40.000 % L from all");
  const std::string huge = effect_line({"self_contact", 1e300, 1e250, false, 0, HUGE_VAL, std::nan("")});
  EXPECT_NE(huge.find("   1e+300 ms a second, moves it by   1e+252 % L; all others:       inf ms,      nan % L from all"), std::string::npos) << huge;
}

TEST(Bench, SpeedTellsWhatEveryStageOfAConversionCosts) {
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(
      directory.path, "bench speed '" HYDROSTAT_SAMPLES "/worm_crawl.glb' -o out --nodes 40 --duration 0.2 --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["schema"], "hydrostat.speed/1");
  for (const char* key : {"small_read_ms", "read_ms", "import_ms"}) EXPECT_GT(json[key], 0) << key;
  EXPECT_LE(json["small_read_ms"], 2 * json["read_ms"].get<double>());
  ASSERT_EQ(json["rows"].size(), 1U);
  for (const char* key : {"nodes", "constraints", "body_ms", "coupling_ms_per_frame", "preparation_ms_per_frame",
                          "inverse_ms_per_frame", "signals_ms", "simulation_ms_per_s", "counted_ms_per_s", "counted_correction_ms_per_s", "real_time"})
    EXPECT_GT(json["rows"][0][key], 0) << key;
  EXPECT_EQ(json["rows"][0]["frames"], 120);
  const std::string csv = io::read_file(directory.path / "out" / "speed.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2);
  EXPECT_FALSE(fs::exists(directory.path / "out" / "small.bvh"));
  EXPECT_EQ(hydrostat_in(directory.path, "bench speed missing.fbx -o out --quiet").exit_code, 1);
  EXPECT_EQ(hydrostat_in(directory.path, "bench speed missing.fbx -o out --nodes 7").exit_code, 2);
}

TEST(Bench, ScalingRefusesWhatItCannotRead) {
  const TemporaryDirectory directory;
  EXPECT_EQ(hydrostat_in(directory.path, "bench scaling missing.toml -o out --quiet").exit_code, 1);
  EXPECT_EQ(hydrostat_in(directory.path, "bench scaling - -o out --threads 1").exit_code, 2);
  EXPECT_EQ(hydrostat_in(directory.path, "bench").exit_code, 2);
}

TEST(Bench, AndSimulateRefuseAnOutputThatCannotBeWrittenBeforeTheyMeasure) {
  const TemporaryDirectory directory;
  io::write_file(directory.path / "scene.toml",
                 "dimension = 2\nduration_s = 60.0\n[body]\nshape = \"square\"\nsize_m = 0.4\nnodes = 200\nposition_m = [0.0, 0.3]\n[ground]\n");
  for (const std::string command : {"bench accuracy scene.toml --max-error 0.001% --duration 60", "bench effects scene.toml --duration 60",
                                    "bench scaling scene.toml", "bench import '" HYDROSTAT_SAMPLES "/worm_crawl.glb'",
                                    "bench speed '" HYDROSTAT_SAMPLES "/worm_crawl.glb'", "simulate scene.toml --max-error 0.001%"}) {
    SCOPED_TRACE(command);
    // Seconds of the processor, which measuring would take and more.
    const std::string limited = "cd '" + directory.path.string() + "' && ulimit -t 3 && '" HYDROSTAT_BINARY "' " + command +
                                " -o scene.toml/out >told 2>complained";
    const int status = std::system(limited.c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << status;
    const std::string complained = io::read_file(directory.path / "complained");
    EXPECT_NE(complained.find("scene.toml/out"), std::string::npos) << complained;
    EXPECT_NE(complained.find("cannot be written: Not a directory. A file stands where a directory is needed"), std::string::npos) << complained;
    EXPECT_EQ(io::read_file(directory.path / "told").find("worm_crawl"), std::string::npos);
  }
}

TEST(GrowthExponent, IsThePowerThatTimesFollow) {
  for (const double power : {0.0, 1.0, 1.5}) {
    std::vector<retarget::ScalingRow> rows;
    for (const int elements : {200, 1000, 7000}) {
      retarget::ScalingRow row;
      row.elements = elements;
      row.cpu_ns = 30 * std::pow(elements, power - 1);
      rows.push_back(row);
    }
    rows.push_back(rows.back());
    rows.back().cpu_ns = 1e9;
    rows.back().is_whole = false;  // does not count
    EXPECT_NEAR(retarget::growth_exponent(rows), power, 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::cli::bench_test
