#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "io/write_file.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat {

struct Outcome {
  int exit_code;
  std::string out, err;
};

/// Runs `hydrostat <arguments>` in a shell, inside `directory`; the arguments are quoted for the shell by the caller,
/// and may send its streams elsewhere.
inline Outcome hydrostat_in(const std::filesystem::path& directory, const std::string& arguments) {
  const TemporaryDirectory streams;
  const auto quoted = [](const std::filesystem::path& path) { return "'" + path.string() + "'"; };
  const std::string command = "cd " + quoted(directory) + " && " + quoted(HYDROSTAT_BINARY) + " >" +
                              quoted(streams.path / "out") + " 2>" + quoted(streams.path / "err") + " " + arguments;
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, io::read_file(streams.path / "out"),
          io::read_file(streams.path / "err")};
}

}  // namespace hydrostat
