#include "cli/command_line.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <new>
#include <sstream>

#include "tests/cli/run_program.h"

namespace hydrostat::cli::command_line_test {
namespace {

TEST(CommandLine, IsTheReadmesSubject) {
  const std::string readme = io::read_file(HYDROSTAT_README);
  int exit_code = 0;
  const std::shared_ptr<CLI::App> app = command_line(exit_code);
  for (const CLI::App* subcommand : app->get_subcommands([](const CLI::App*) { return true; })) {
    if (subcommand->get_group().empty()) continue;  // for the program's own use
    EXPECT_NE(readme.find("hydrostat " + subcommand->get_name()), std::string::npos)
        << "README.md does not mention 'hydrostat " << subcommand->get_name() << "'";
    for (const CLI::Option* option : subcommand->get_options()) {
      if (option->get_group().empty() || option->get_lnames().empty()) continue;
      EXPECT_NE(readme.find("--" + option->get_lnames().front()), std::string::npos)
          << "README.md does not mention --" << option->get_lnames().front() << " of " << subcommand->get_name();
    }
  }
}

TEST(CommandLine, VerbsOfSignalsStandInTheReadmeWithTheirOptions) {
  const std::string readme = io::read_file(HYDROSTAT_README);
  int exit_code = 0, seen = 0;
  const std::shared_ptr<CLI::App> app = command_line(exit_code);
  for (const CLI::App* verb : app->get_subcommand("signals")->get_subcommands([](const CLI::App*) { return true; })) {
    if (verb->get_name().empty()) continue;  // a group of options
    ++seen;
    const std::size_t begin = readme.find("\nhydrostat signals DIR " + verb->get_name());
    ASSERT_NE(begin, std::string::npos) << verb->get_name();
    const std::string line = readme.substr(begin + 1, readme.find('\n', begin + 1) - begin);
    std::vector<const CLI::Option*> options = verb->get_options();
    for (const CLI::App* group : verb->get_subcommands([](const CLI::App* some) { return some->get_name().empty(); })) {
      for (const CLI::Option* option : group->get_options()) options.push_back(option);
    }
    for (const CLI::Option* option : options) {
      if (option->get_lnames().empty() || option->get_lnames().front() == "help") continue;
      EXPECT_NE(line.find("--" + option->get_lnames().front()), std::string::npos) << option->get_lnames().front() << " of " << line;
    }
  }
  EXPECT_EQ(seen, 8);
}

/// Choices are those of a type name such as TEXT:{tet,hex}.
TEST(CommandLine, HelpThatNamesTwoChoicesNamesAll) {
  int exit_code = 0, seen = 0;
  const std::shared_ptr<CLI::App> app = command_line(exit_code);
  for (const CLI::App* subcommand : app->get_subcommands([](const CLI::App*) { return true; })) {
    for (const CLI::Option* option : subcommand->get_options()) {
      const std::string type = option->get_type_name(), text = " " + option->get_description() + " ";
      const std::size_t begin = type.find('{'), end = type.find('}');
      if (begin == std::string::npos || end == std::string::npos) continue;
      std::vector<std::string> named, left_out;
      std::istringstream choices(type.substr(begin + 1, end - begin - 1));
      for (std::string choice; std::getline(choices, choice, ',');) {
        const std::size_t at = text.find(" " + choice);
        const bool is_named = at != std::string::npos && std::isalnum(static_cast<unsigned char>(text[at + 1 + choice.size()])) == 0;
        (is_named ? named : left_out).push_back(choice);
      }
      if (named.size() < 2) continue;
      ++seen;
      EXPECT_TRUE(left_out.empty()) << "--help of " << subcommand->get_name() << " leaves out '" << left_out.front() << "' of " << option->get_name();
    }
  }
  EXPECT_GE(seen, 4);
}

TEST(CommandLine, TellsUsageErrorsOnOneLineWithExitCode2) {
  const TemporaryDirectory directory;
  const auto expect = [&](const std::string& arguments, const std::string& message) {
    SCOPED_TRACE(arguments);
    const Outcome outcome = hydrostat_in(directory.path, arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.err, message + "\n");
  };
  expect("", "hydrostat: command line: A subcommand is required. 'hydrostat --help' tells what it takes.");
  expect("dance", "hydrostat: command line: 'dance' is no subcommand. 'hydrostat --help' lists them.");
  expect("batch", "hydrostat batch: command line: MANIFEST is required. 'hydrostat batch --help' tells what it takes.");
  expect("batch m.toml --jobs 0",
         "hydrostat batch: option --jobs: Value 0 not in range 1 to 256. 'hydrostat batch --help' tells what it takes.");
}

TEST(CommandLine, TellsUnexpectedArgumentsInTheirOrder) {
  const TemporaryDirectory directory;
  EXPECT_EQ(hydrostat_in(directory.path, "batch M --threads 1").err,
            "hydrostat batch: command line: The following arguments were not expected: --threads 1. 'hydrostat batch --help' tells what it takes.\n");
  EXPECT_EQ(hydrostat_in(directory.path, "bench effects M -o out --thread=1 two three").err,
            "hydrostat bench: command line: The following arguments were not expected: --thread=1 two three. 'hydrostat bench --help' tells what it takes.\n");
}

/// Before anything is read or made, hence with clips and creatures that are none.
TEST(CommandLine, APlaceIsNeitherEmptyNorAnOption) {
  const TemporaryDirectory directory;
  for (const std::string command :
       {"convert clip.glb -o", "convert clip.glb -o out --scene", "replay creature -o", "replay creature --scene", "replay creature --trace", "simulate s.toml -o",
        "simulate s.toml -o out --trace", "compare a b -o", "batch m.toml -o", "bench effects s.toml -o", "bench accuracy s.toml -o", "bench scaling s.toml -o",
        "bench import clip.glb -o", "bench speed -o"}) {
    SCOPED_TRACE(command);
    const std::string option = command.ends_with(" -o") ? "--out" : command.substr(command.rfind(' ') + 1);
    const Outcome empty = hydrostat_in(directory.path, command + " ''"), swallowed = hydrostat_in(directory.path, command + " --quiet");
    EXPECT_EQ(empty.exit_code, 2);
    EXPECT_NE(empty.err.find("option " + option + ": is empty where a path belongs. "), std::string::npos) << empty.err;
    EXPECT_EQ(swallowed.exit_code, 2);
    EXPECT_NE(swallowed.err.find("option " + option + ": '--quiet' is an option where a path belongs (a file of that name is ./--quiet). "), std::string::npos)
        << swallowed.err;
  }
  EXPECT_EQ(directory.count(), 0U);
}

TEST(CommandLine, AnErrorThatIsNoneIsRefusedBeforeTheClipIsRead) {
  const TemporaryDirectory directory;
  for (const char* error : {"60%", "abc", "0", "0.000001%"}) {
    const Outcome outcome = hydrostat_in(directory.path, std::string("convert none.glb -o out --quiet --max-error ") + error);
    EXPECT_EQ(outcome.exit_code, 2) << error;
    EXPECT_EQ(outcome.err.find("hydrostat convert: option --max-error: '" + std::string(error) + "' is no share of L"), 0U) << outcome.err;
  }
}

TEST(CommandLine, ListsItsSubcommandsAndItsVersion) {
  const TemporaryDirectory directory;
  const Outcome help = hydrostat_in(directory.path, "--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("batch"), std::string::npos);
  EXPECT_EQ(help.err, "");
  const Outcome version = hydrostat_in(directory.path, "--version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out.find("hydrostat "), 0U);
}

TEST(CommandLine, TellsThatItsOutputIsLost) {
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(directory.path, "--help >/dev/full");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "standard output: cannot be written. Free space where it is sent, or send it elsewhere.\n");
}

TEST(OneLine, HoldsFilePlaceFaultAndMend) {
  EXPECT_EQ(
      one_line({"walk.glb", "bone 'LeftFoot'", "inverse bind matrix is singular", "Give the bone a scale other than 0."}),
      "walk.glb: bone 'LeftFoot': inverse bind matrix is singular. Give the bone a scale other than 0.");
  EXPECT_EQ(one_line({"walk.glb", "", "cannot be\nread.", "Check it"}), "walk.glb: cannot be read. Check it.");
  EXPECT_EQ(one_line({"", "", "lost", ""}), "lost.");
  EXPECT_EQ(one_line({"", "", "lost", "Did you mean 'found'?"}), "lost. Did you mean 'found'?");
}

}  // namespace
}  // namespace hydrostat::cli::command_line_test
