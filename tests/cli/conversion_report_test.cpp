#include "cli/conversion_report.h"

#include <gtest/gtest.h>

#include "io/write_file.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::cli::conversion_report_test {
namespace {

TEST(ConversionReport, RecordsEveryMeshThatCameAlongSoThatTheRecordIsReadAgain) {
  for (const std::size_t count : {0, 1, 2, 5}) {
    ConvertOptions options;
    options.clip_file = "clip.glb";
    for (std::size_t k = 0; k < count; ++k) options.import.meshes.push_back("mesh " + std::to_string(k));
    const TemporaryDirectory directory;
    io::write_file(directory.path / "creature.toml", io::to_toml(creature_record(options, {}, {}, std::nullopt, {}, {})));
    std::vector<std::string> meshes;
    for (const auto& [name, value] : io::read_creature_record(directory.path).settings) {
      if (name.starts_with("mesh")) meshes.push_back(std::get<std::string>(value));
    }
    EXPECT_EQ(meshes, options.import.meshes);
  }
}

}  // namespace
}  // namespace hydrostat::cli::conversion_report_test
