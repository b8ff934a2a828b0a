#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "cli/subcommands.h"
#include "io/import_worker.h"
#include "retarget/error.h"

namespace {

int tell(const hydrostat::Error& error, int exit_code) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  std::fprintf(stderr, "%s: %s%s. %s.\n", error.file.c_str(), place.c_str(), error.what(), error.mend.c_str());
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  if (const std::optional<int> worker = hydrostat::io::run_import_worker(argc, argv)) return *worker;
  CLI::App app{"Turns an animator's skeletal clip into a soft body that moves by itself.", "hydrostat"};
  app.require_subcommand(1);
  int exit_code = 0;
  hydrostat::cli::add_info(app, exit_code);
  hydrostat::cli::add_signals(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const hydrostat::UsageError& error) {
    return tell(error, 2);
  } catch (const hydrostat::Error& error) {
    return tell(error, 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hydrostat: %s.\n", error.what());
    return 1;
  }
  return exit_code;
}
