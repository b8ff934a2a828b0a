#include "io/stage_cache.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>

#include "io/fingerprint.h"
#include "io/write_file.h"

namespace hydrostat::io {

namespace fs = std::filesystem;

// An entry: the magic line, stage, key, then each kind of value as a count and its (name, value) pairs, then the SHA-256 of
// all before. Numbers are 8 bytes (indices 4), little-endian; texts and matrices begin with their sizes.
static_assert(std::endian::native == std::endian::little, "stage-cache entries are written as memory holds them");

namespace {

constexpr std::string_view kStageMagic = "hydrostat.cache/1\n";
constexpr std::size_t kChecksumSize = 64;

class RecordWriter {
 public:
  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void put(Number number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof(number)); }
  void put(std::string_view text) {
    put(std::uint64_t{text.size()});
    bytes += text;
  }
  template <typename Scalar>
  void put(const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& matrix) {
    put(std::int64_t{matrix.rows()});
    put(std::int64_t{matrix.cols()});
    bytes.append(reinterpret_cast<const char*>(matrix.data()), static_cast<std::size_t>(matrix.size()) * sizeof(Scalar));
  }
  template <typename Value>
  void put(const std::map<std::string, Value>& values) {
    put(std::uint64_t{values.size()});
    for (const auto& [name, value] : values) {
      put(std::string_view(name));
      put(value);
    }
  }

  std::string bytes;
};

/// Reads what RecordWriter wrote. The checksum has vouched for the bytes, yet no size is trusted beyond what is left of them.
class RecordReader {
 public:
  explicit RecordReader(std::string_view bytes) : left_(bytes) {}

  bool sound_and_at_end() const { return sound_ && left_.empty(); }

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void get(Number& number) { copy_to(&number, 1); }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    if (!has_room_for(size, 1)) return;
    text.assign(left_.substr(0, size));
    left_.remove_prefix(size);
  }
  template <typename Scalar>
  void get(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& matrix) {
    std::int64_t rows = 0, cols = 0;
    get(rows);
    get(cols);
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();  // so that the product fits
    sound_ = sound_ && rows >= 0 && cols >= 0 && rows <= kMost && cols <= kMost;
    const std::uint64_t size = sound_ ? static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(cols) : 0;
    if (!has_room_for(size, sizeof(Scalar))) return;
    matrix.resize(rows, cols);
    copy_to(matrix.data(), size);
  }
  template <typename Value>
  void get(std::map<std::string, Value>& values) {
    std::uint64_t count = 0;
    get(count);
    for (std::uint64_t i = 0; i < count && sound_; ++i) {
      std::string name;
      get(name);
      get(values[name]);
    }
  }

 private:
  bool has_room_for(std::uint64_t count, std::size_t size) {
    sound_ = sound_ && count <= left_.size() / size;
    return sound_;
  }
  template <typename Number>
  void copy_to(Number* to, std::uint64_t count) {
    if (!has_room_for(count, sizeof(Number)) || count == 0) return;
    std::memcpy(to, left_.data(), count * sizeof(Number));
    left_.remove_prefix(count * sizeof(Number));
  }

  std::string_view left_;
  bool sound_ = true;
};

std::string entry_name(const std::string& stage, const std::string& key) { return stage + "-" + key + ".bin"; }

/// Whether a file is an entry of `stage`: "body-<digits>.bin" is one of "body", "body-fine-<digits>.bin" is not.
bool is_entry_of(const std::string& stage, const std::string& file) {
  return file.starts_with(stage + "-") && file.ends_with(".bin") && file.find('-', stage.size() + 1) == std::string::npos;
}

}  // namespace

std::string packed(const Record& record, const std::string& stage, const std::string& key) {
  RecordWriter writer;
  writer.bytes = kStageMagic;
  writer.put(std::string_view(stage));
  writer.put(std::string_view(key));
  writer.put(record.matrices);
  writer.put(record.index_matrices);
  writer.put(record.scalars);
  writer.put(record.strings);
  writer.bytes += sha256(writer.bytes);
  return std::move(writer.bytes);
}

std::optional<Record> unpacked(const std::string& bytes, const std::string& stage, const std::string& key) {
  if (bytes.size() < kStageMagic.size() + kChecksumSize || !bytes.starts_with(kStageMagic)) return std::nullopt;
  const std::string_view body = std::string_view(bytes).substr(0, bytes.size() - kChecksumSize);
  if (sha256(body) != std::string_view(bytes).substr(body.size())) return std::nullopt;

  RecordReader reader(body.substr(kStageMagic.size()));
  std::string stored_stage, stored_key;
  Record record;
  reader.get(stored_stage);
  reader.get(stored_key);
  reader.get(record.matrices);
  reader.get(record.index_matrices);
  reader.get(record.scalars);
  reader.get(record.strings);
  if (!reader.sound_and_at_end() || stored_stage != stage || stored_key != key) return std::nullopt;
  return record;
}

std::optional<Record> StageCache::load(const std::string& stage, const std::string& key) const {
  const fs::path file = directory_ / entry_name(stage, key);
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  return unpacked(read_file(file), stage, key);
}

void StageCache::store(const std::string& stage, const std::string& key, const Record& record) const {
  const fs::path file = directory_ / entry_name(stage, key);
  write_file(file, packed(record, stage, key));
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_)) {
    if (entry.path() != file && is_entry_of(stage, entry.path().filename().string())) fs::remove(entry.path());
  }
}

}  // namespace hydrostat::io
