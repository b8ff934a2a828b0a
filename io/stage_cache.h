#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace hydrostat::io {

/// The result of a stage as named values, each kind with names of its own.
struct Record {
  std::map<std::string, Eigen::MatrixXd> matrices;
  std::map<std::string, Eigen::MatrixXi> index_matrices;
  std::map<std::string, double> scalars;  // whole numbers too: exact up to 2^53
  std::map<std::string, std::string> strings;
};

/// A record as the bytes of a file, with a checksum, under a title that says what it is.
std::string packed(const Record& record, const std::string& stage, const std::string& key);

/// The record in such bytes; nothing where they are damaged, cut short, of another version or another title.
std::optional<Record> unpacked(const std::string& bytes, const std::string& stage, const std::string& key);

/// Results of stages in a directory, one file "<stage>-<key>.bin" each. The key is the fingerprint (io/fingerprint.h) of all
/// that the stage depends on: schema version, inputs, option values. An entry that is damaged, cut short, of another
/// version, stage or key counts as absent, so that the stage runs again.
class StageCache {
 public:
  explicit StageCache(std::filesystem::path directory) : directory_(std::move(directory)) {}

  std::optional<Record> load(const std::string& stage, const std::string& key) const;
  /// Writes the entry whole and removes the stage's entries of other keys. Throws Error when it cannot be written.
  void store(const std::string& stage, const std::string& key, const Record& record) const;

 private:
  std::filesystem::path directory_;
};

}  // namespace hydrostat::io
