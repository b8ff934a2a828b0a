#include "io/fingerprint.h"

#include <gtest/gtest.h>

#include <set>

#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::fingerprint_test {
namespace {

TEST(Fingerprint, AgreesWithTheStandardsOwnExample) {
  // FIPS 180-2, appendix B.1
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Fingerprint, OfAFileIsThatOfItsBytes) {
  const TemporaryDirectory directory;
  const std::string bytes(200'000, '\0');  // more than one block of reading
  write_file(directory.path / "file", bytes);
  write_file(directory.path / "empty", "");
  EXPECT_EQ(file_sha256(directory.path / "file"), sha256(bytes));
  EXPECT_EQ(file_sha256(directory.path / "empty"), sha256(""));
  EXPECT_NE(refusal([&] { file_sha256(directory.path / "none"); }).find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal([&] { file_sha256(directory.path); }).find("cannot be read"), std::string::npos);
}

TEST(Fingerprint, TellsEveryDifferenceApart) {
  Eigen::MatrixXd matrix(2, 3);
  matrix << 1, 2, 3, 4, 5, 6;
  Eigen::MatrixXd nudged = matrix;
  nudged(1, 2) = std::nextafter(6.0, 7.0);
  const std::set<std::string> all{
      Fingerprint().hex(),
      Fingerprint().add("a", "b").hex(),
      Fingerprint().add("ab", "").hex(),
      Fingerprint().add("a", "b").add("c", "d").hex(),
      Fingerprint().add("c", "d").add("a", "b").hex(),
      Fingerprint().add("a", "bcd").hex(),
      Fingerprint().add("a", 1).hex(),
      Fingerprint().add("a", 1.0).hex(),
      Fingerprint().add("a", "1").hex(),
      Fingerprint().add("a", matrix).hex(),
      Fingerprint().add("a", nudged).hex(),
      Fingerprint().add("a", Eigen::MatrixXd(matrix.reshaped(3, 2))).hex(),
      Fingerprint().add("a", Eigen::MatrixXi(matrix.cast<int>())).hex(),
  };
  EXPECT_EQ(all.size(), 13U);
}

TEST(Fingerprint, DoesNotAskWhereAMatrixLies) {
  const Eigen::MatrixXd whole = Eigen::MatrixXd::Random(6, 4);
  const Eigen::MatrixXd part = whole.topRows(3);
  EXPECT_EQ(Fingerprint().add("m", whole.topRows(3)).hex(), Fingerprint().add("m", part).hex());
}

TEST(Fingerprint, MayGrowAfterItWasAsked) {
  Fingerprint asked;
  asked.add("a", 1);
  const std::string first = asked.hex();
  EXPECT_EQ(first, asked.hex());
  asked.add("b", 2);
  EXPECT_EQ(asked.hex(), Fingerprint().add("a", 1).add("b", 2).hex());
}

}  // namespace
}  // namespace hydrostat::io::fingerprint_test
