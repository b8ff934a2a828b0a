#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace hydrostat::io {

/// SHA-256 over a sequence of named values. Names, kinds and sizes go in with the values, so that two sequences agree only
/// when they hold the same values under the same names in the same order.
class Fingerprint {
 public:
  Fingerprint();
  ~Fingerprint();
  Fingerprint(const Fingerprint&) = delete;
  Fingerprint& operator=(const Fingerprint&) = delete;

  Fingerprint& add(std::string_view name, std::string_view text);
  Fingerprint& add(std::string_view name, const char* text) { return add(name, std::string_view(text)); }
  Fingerprint& add(std::string_view name, std::int64_t number);
  Fingerprint& add(std::string_view name, int number) { return add(name, std::int64_t{number}); }
  Fingerprint& add(std::string_view name, bool flag) { return add(name, std::int64_t{flag}); }
  Fingerprint& add(std::string_view name, double number);
  Fingerprint& add(std::string_view name, const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  Fingerprint& add(std::string_view name, const Eigen::Ref<const Eigen::MatrixXi>& matrix);

  /// 64 hexadecimal digits over all that was added so far; more may be added after it.
  std::string hex() const;

 private:
  struct State;
  void add_bytes(std::string_view name, char kind, const void* bytes, std::size_t size);
  std::unique_ptr<State> state_;
};

/// SHA-256 of plain bytes, 64 hexadecimal digits (what `sha256sum` prints).
std::string sha256(std::string_view bytes);

/// SHA-256 of a file's bytes. Throws Error when it cannot be read.
std::string file_sha256(const std::filesystem::path& file);

}  // namespace hydrostat::io
