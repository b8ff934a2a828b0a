#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace hydrostat {

/// Spoils a file's bytes in one place, or in up to eight, by chance alone: a seed gives the same bytes on every machine. `others` are
/// files of the same kind, to take pieces from.
class Mutator {
 public:
  Mutator(std::uint64_t seed, const std::vector<std::string>& others) : random_(seed), others_(others) {}

  std::string mutate(std::string bytes) {
    const std::size_t places = below(2) == 0 ? 1 : 1 + below(8);
    for (std::size_t i = 0; i < places && !bytes.empty(); ++i) spoil(bytes);
    return bytes;
  }

 private:
  // Not std::uniform_int_distribution, whose numbers differ between libraries.
  std::size_t below(std::size_t bound) { return bound == 0 ? 0 : static_cast<std::size_t>(random_() % bound); }

  void spoil(std::string& bytes) {
    const std::size_t at = below(bytes.size());
    const std::size_t length = std::min(bytes.size() - at, 1 + below(below(4) == 0 ? 4096 : 16));
    switch (below(10)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(random_());
        break;
      case 2:
        overwrite_word(bytes, at);
        break;
      case 3:
        bytes.erase(at, length);
        break;
      case 4:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 5: {
        const std::string& other = others_[below(others_.size())];
        if (!other.empty()) bytes.replace(at, length, other, below(other.size()), length);
        break;
      }
      case 6:
        if (below(8) == 0) bytes.resize(at);
        break;
      default:
        replace_number(bytes, at);
    }
  }

  /// Words that readers take for sizes, counts, indices and numbers.
  void overwrite_word(std::string& bytes, std::size_t at) {
    static constexpr std::uint64_t kWords[] = {0,
                                               1,
                                               0x7f,
                                               0xff,
                                               0x7fff,
                                               0xffff,
                                               0x7fffffff,
                                               0x80000000,
                                               0xffffffff,
                                               0x7fc00000,
                                               0x7ff8000000000000,
                                               0x7fefffffffffffff,
                                               0xffffffffffffffff};
    const std::uint64_t word = kWords[below(std::size(kWords))];
    std::memcpy(bytes.data() + at, &word, std::min<std::size_t>(bytes.size() - at, std::size_t{1} << below(4)));
  }

  /// The next number in text, where there is one near by.
  void replace_number(std::string& bytes, std::size_t at) {
    static constexpr const char* kNumbers[] = {"0",   "-1",        "1e308",  "-1e39",      "1e-320", "nan",
                                               "inf", "0.5",       "999999", "4294967295", "65536",  "18446744073709551616",
                                               "",    "2147483648"};
    const auto is_part = [&](std::size_t i) {
      return bytes[i] == '-' || bytes[i] == '.' || (bytes[i] >= '0' && bytes[i] <= '9');
    };
    const std::size_t limit = std::min(bytes.size(), at + 256);
    while (at < limit && !is_part(at)) ++at;
    std::size_t end = at;
    while (end < limit && is_part(end)) ++end;
    if (end > at) bytes.replace(at, end - at, kNumbers[below(std::size(kNumbers))]);
  }

  std::mt19937_64 random_;
  const std::vector<std::string>& others_;
};

}  // namespace hydrostat
