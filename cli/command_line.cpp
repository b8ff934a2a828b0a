#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <new>

namespace hydrostat::cli {

namespace {

std::string subcommand_in_use(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? "hydrostat" : "hydrostat " + chosen.front()->get_name();
}

/// CLI11 would tell them last to first.
std::string not_expected(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining(/*recurse=*/true);
  return (words.size() > 1 ? "The following arguments were not expected: " : "The following argument was not expected: ") + CLI::detail::join(words, " ");
}

/// CLI11 writes "--jobs: Value 0 not in range", "Could not convert: --jobs = 1.5" or "CLIP is required": the option moves to the
/// place of the message.
UsageError usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const std::string command = subcommand_in_use(app);
  if (app.get_subcommands().empty() && !app.remaining().empty()) {
    return {command, "command line", "'" + app.remaining().front() + "' is no subcommand", "'hydrostat --help' lists them."};
  }
  std::string what = dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr ? error.what() : not_expected(app);
  std::string where = "command line";
  const std::string unreadable = "Could not convert: ";
  if (const std::size_t equals = what.find(" = "); what.starts_with(unreadable + "--") && equals != std::string::npos) {
    what = what.substr(unreadable.size(), equals - unreadable.size()) + ": '" + what.substr(equals + 3) + "' is not a whole number of its range";
  }
  const std::size_t colon = what.find(": ");
  if (what.starts_with("--") && colon != std::string::npos) {
    where = "option " + what.substr(0, colon);
    what = what.substr(colon + 2);
  }
  return {command, where, what, "'" + command + " --help' tells what it takes."};
}

int refuse(std::ostream& errors, const Error& error, ExitCode exit_code) {
  errors << one_line(error) << std::endl;
  return exit_code;
}

}  // namespace

std::shared_ptr<CLI::App> command_line(int& exit_code) {
  auto app =
      std::make_shared<CLI::App>("Hydrostat turns an animator's clip into a soft body that moves by itself.", "hydrostat");
  app->set_version_flag("--version", "hydrostat " HYDROSTAT_VERSION, "Print the version and leave");
  app->set_help_flag("-h,--help", "Print this and leave");
  app->require_subcommand(1);
  app->footer(
      "Exit codes: 0 done; 1 input refused or output not writable; 2 usage; 3 outcome short of what was asked; 4 some jobs "
      "of a "
      "batch failed.");
  add_info(*app, exit_code);
  add_convert(*app, exit_code);
  add_replay(*app, exit_code);
  add_simulate(*app, exit_code);
  add_signals(*app, exit_code);
  add_batch(*app, exit_code);
  add_bench(*app, exit_code);
  add_compare(*app, exit_code);
  add_explain(*app, exit_code);
  return app;
}

std::string one_line(const Error& error) {
  std::string line;
  for (const std::string& part : {error.file, error.where}) {
    if (!part.empty()) line += part + ": ";
  }
  line += error.what();
  if (!line.ends_with('.')) line += '.';
  if (!error.mend.empty()) line += ' ' + error.mend;
  if (!line.ends_with('.') && !line.ends_with('?')) line += '.';
  for (char& letter : line) {
    if (letter == '\n' || letter == '\r') letter = ' ';
  }
  return line;
}

int run(int argc, const char* const* argv, std::ostream& errors) {
  int exit_code = kDone;
  const std::shared_ptr<CLI::App> app = command_line(exit_code);
  try {
    try {
      app->parse(argc, argv);
    } catch (const CLI::Success& wish) {  // --help, --version
      app->exit(wish);
    }
    if (!std::cout.flush()) {
      throw Error("standard output", "", "cannot be written", "Free space where it is sent, or send it elsewhere.");
    }
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return refuse(errors, usage_error(*app, error), kUsage);
  } catch (const UsageError& error) {
    return refuse(errors, error, kUsage);
  } catch (const Error& error) {
    return refuse(errors, error, kInputRefused);
  } catch (const std::bad_alloc&) {
    return refuse(errors,
                  {subcommand_in_use(*app), "memory", "there is not enough of it",
                   "Give fewer --nodes or a shorter clip, or free memory."},
                  kInputRefused);
  } catch (const std::exception& error) {
    return refuse(errors,
                  {subcommand_in_use(*app), "", std::string("stopped by a fault of its own: ") + error.what(),
                   "Please report it with the command and the input."},
                  kInputRefused);
  }
}

}  // namespace hydrostat::cli
