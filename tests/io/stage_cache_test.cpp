#include "io/stage_cache.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::stage_cache_test {
namespace {

Record random_record(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> size(0, 7);
  std::normal_distribution<double> value;
  Record record;
  for (int i = size(random); i > 0; --i) {
    Eigen::MatrixXd matrix(size(random), size(random));
    for (double& entry : matrix.reshaped()) entry = value(random);
    record.matrices["matrix " + std::to_string(i)] = matrix;
    record.index_matrices["indices " + std::to_string(i)] = (1e6 * matrix).cast<int>();
    record.scalars["scalar " + std::to_string(i)] = value(random);
    record.strings["string " + std::to_string(i)] = std::string(static_cast<std::size_t>(size(random)), '\0');
  }
  record.scalars["infinite"] = -std::numeric_limits<double>::infinity();
  return record;
}

void expect_same(const Record& one, const Record& other) {
  EXPECT_EQ(one.scalars, other.scalars);
  EXPECT_EQ(one.strings, other.strings);
  EXPECT_EQ(one.matrices.size(), other.matrices.size());
  for (const auto& [name, matrix] : one.matrices) {
    ASSERT_TRUE(other.matrices.contains(name));
    const Eigen::MatrixXd& twin = other.matrices.at(name);
    ASSERT_TRUE(matrix.rows() == twin.rows() && matrix.cols() == twin.cols());
    EXPECT_TRUE(matrix == twin);
  }
  EXPECT_EQ(one.index_matrices.size(), other.index_matrices.size());
  for (const auto& [name, matrix] : one.index_matrices) {
    ASSERT_TRUE(other.index_matrices.contains(name));
    EXPECT_TRUE(matrix == other.index_matrices.at(name));
  }
}

TEST(StageCache, GivesBackWhatWasStored) {
  const TemporaryDirectory directory;
  const StageCache cache(directory.path / "cache");
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Record record = random_record(seed);
    cache.store("invert", "k" + std::to_string(seed), record);
    const std::optional<Record> loaded = cache.load("invert", "k" + std::to_string(seed));
    ASSERT_TRUE(loaded);
    expect_same(record, *loaded);
  }
}

TEST(StageCache, HoldsOneEntryAStage) {
  const TemporaryDirectory directory;
  const StageCache cache(directory.path);
  cache.store("body", "old", random_record(1));
  cache.store("body-fine", "other", random_record(2));
  write_file(directory.path / "bodywork-old.bin", "not ours");
  cache.store("body", "new", random_record(3));
  EXPECT_FALSE(cache.load("body", "old"));
  EXPECT_TRUE(cache.load("body", "new"));
  EXPECT_TRUE(cache.load("body-fine", "other"));
  EXPECT_EQ(directory.count(), 3U);
}

TEST(StageCache, KnowsNothingOfOtherKeysAndStages) {
  const TemporaryDirectory directory;
  const StageCache cache(directory.path);
  EXPECT_FALSE(cache.load("body", "key"));
  cache.store("body", "key", random_record(1));
  EXPECT_FALSE(cache.load("body", "other"));
  std::filesystem::copy(directory.path / "body-key.bin", directory.path / "body-other.bin");
  std::filesystem::copy(directory.path / "body-key.bin", directory.path / "couple-key.bin");
  EXPECT_FALSE(cache.load("body", "other"));
  EXPECT_FALSE(cache.load("couple", "key"));
}

TEST(StageCache, IgnoresADamagedEntry) {
  const TemporaryDirectory directory;
  const StageCache cache(directory.path);
  const Record record = random_record(7);
  cache.store("body", "key", record);
  const std::string sound = read_file(directory.path / "body-key.bin");
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const std::size_t place = random() % sound.size();
    std::string flipped = sound;
    flipped[place] = static_cast<char>(flipped[place] ^ (1 << (trial % 8)));
    write_file(directory.path / "body-key.bin", flipped);
    EXPECT_FALSE(cache.load("body", "key"));
    write_file(directory.path / "body-key.bin", sound.substr(0, place));
    EXPECT_FALSE(cache.load("body", "key"));
  }
  cache.store("body", "key", record);
  ASSERT_TRUE(cache.load("body", "key"));
  expect_same(record, *cache.load("body", "key"));
}

TEST(StageCache, TellsThatItCannotBeWritten) {
  const TemporaryDirectory directory;
  write_file(directory.path / "cache", "a file");
  const std::string told = refusal([&] { StageCache(directory.path / "cache").store("body", "key", {}); });
  EXPECT_NE(told.find("cannot be written"), std::string::npos) << told;
}

}  // namespace
}  // namespace hydrostat::io::stage_cache_test
