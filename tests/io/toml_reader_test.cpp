#include "io/toml_reader.h"

#include <gtest/gtest.h>

#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::toml_reader_test {
namespace {

TEST(NearestWord, IsTheOneWithTheFewestChanges) {
  const std::vector<std::string> known{"size_m", "shape", "position_m", "youngs_modulus_pa"};
  EXPECT_EQ(nearest_word("shpe", known), "shape");
  EXPECT_EQ(nearest_word("size", known), "size_m");
  EXPECT_EQ(nearest_word("youngs_modulus", known), "youngs_modulus_pa");
  EXPECT_EQ(nearest_word("position_m_s", known), "position_m");
  EXPECT_EQ(nearest_word("modulus_pa", known), "youngs_modulus_pa");
  EXPECT_EQ(nearest_word("colour", known), "");
  EXPECT_EQ(nearest_word("", known), "");
}

/// A reader of a text, with the file that it lies in.
struct Read {
  explicit Read(const std::string& text) : file(directory.path / "a.toml") {
    write_file(file, text);
    table = parse_toml(file);
  }
  TomlReader reader() const { return {table, file, "[body]"}; }

  TemporaryDirectory directory;
  std::filesystem::path file;
  toml::table table;
};

TEST(TomlReader, GivesWhatStandsThereAndWhatIsMissingByDefault) {
  const Read text("a = 1\nb = 2.5\nc = \"two\"\nd = [1, 2.5]\ne = [[0, 1], [2, 3]]\n[f]\nx = 1\n[[g]]\n[[g]]\n");
  const TomlReader reader = text.reader();
  EXPECT_EQ(reader.number("a"), 1);
  EXPECT_EQ(reader.number_or("b", 0), 2.5);
  EXPECT_EQ(reader.number_or("missing", 7), 7);
  EXPECT_EQ(reader.whole_or("a", 5, 0, 9), 1);
  EXPECT_EQ(reader.choice("c", {"one", "two"}), "two");
  EXPECT_EQ(reader.choice_or_first("missing", {"one", "two"}), "one");
  EXPECT_EQ(reader.numbers("d", 2), Eigen::Vector2d(1, 2.5));
  EXPECT_EQ(reader.number_or_numbers("a", 2), Eigen::Vector2d(1, 1));
  EXPECT_EQ(reader.lists("e", 2), (Eigen::Matrix2d{{0, 2}, {1, 3}}));
  EXPECT_EQ(reader.table("f")->number("x"), 1);
  EXPECT_FALSE(reader.table("missing").has_value());
  EXPECT_EQ(reader.tables("g").size(), 2U);
  EXPECT_EQ(reader.tables("missing").size(), 0U);
  reader.refuse_others();
}

TEST(TomlReader, RefusesWithTheLine) {
  const Read text("\na = -1\nb = \"text\"\nc = [1, 2]\nf = 1\nshpe = 1\nnan = nan\n");
  const TomlReader reader = text.reader();
  const auto expect = [&](const auto& action, const std::string& where, const std::string& what, const std::string& mend) {
    EXPECT_EQ(refusal(action), text.file.string() + "|" + where + "|" + what + "|" + mend);
  };
  expect([&] { reader.number("a", kAboveZero); }, "line 2", "'a' of [body] is -1", "Give a number that is above 0.");
  expect([&] { reader.number("b"); }, "line 3", "'b' of [body] is a text where a number belongs", "Give a number that is finite.");
  expect([&] { reader.number("nan"); }, "line 7", "'nan' of [body] is nan", "Give a number that is finite.");
  expect([&] { reader.number("a", {.least = 0, .most = 0.5, .without_most = true}); }, "line 2", "'a' of [body] is -1",
         "Give a number that is at least 0 and below 0.5.");
  expect([&] { reader.numbers("c", 3); }, "line 4", "'c' of [body] is not a list of 3 numbers", "Write it like c = [0.0, 1.0, 0.0].");
  expect([&] { reader.text("a"); }, "line 2", "'a' of [body] is a number where a text belongs", "Write it in quotes.");
  expect([&] { reader.choice("b", {"test", "other"}); }, "line 3", "'b' of [body] is 'text', which is none of test, other", "Did you mean 'test'?");
  expect([&] { reader.table("f"); }, "line 5", "'f' is a number where a table belongs", "Write [f] on a line of its own.");
  expect([&] { reader.tables("f"); }, "line 5", "'f' is a number where a list of tables belongs", "Write [[f]] on a line of its own for each.");
  expect([&] { reader.whole_or("a", 0, 0, 9); }, "line 2", "'a' of [body] is no whole number from 0 to 9", "Give one within.");
  EXPECT_FALSE(reader.has("shape"));
  expect([&] { reader.refuse_others(); }, "line 6", "'shpe' of [body] is not known here", "Did you mean 'shape'?");
}

TEST(TomlReader, RefusesWhatIsNoToml) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path / "a.toml";
  write_file(file, "a = 1\nb = \n");
  EXPECT_NE(refusal([&] { parse_toml(file); }).find("|line 2|"), std::string::npos);
  EXPECT_NE(refusal([&] { parse_toml(directory.path / "none.toml"); }).find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace hydrostat::io::toml_reader_test
