#pragma once

#include <stdexcept>
#include <string>

namespace hydrostat {

/// What a user's input can do wrong. Thrown from retarget, io and cli only and caught once per clip, where it is printed as
/// "file: where: what is wrong. How to mend."
struct Error : std::runtime_error {
  Error(std::string file_name, std::string place, const std::string& what_is_wrong, std::string how_to_mend)
      : std::runtime_error(what_is_wrong),
        file(std::move(file_name)),
        where(std::move(place)),
        mend(std::move(how_to_mend)) {}

  std::string file;   // "walk.glb"
  std::string where;  // "bone 'LeftFoot'", "line 12", "option --nodes"
  std::string mend;   // one sentence: what to change
};

/// An option or a call that is not in the command line's language: exit code 2, where Error gives 1.
struct UsageError : Error {
  using Error::Error;
};

}  // namespace hydrostat
