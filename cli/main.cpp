#include <csignal>
#include <iostream>

#include "cli/command_line.h"
#include "io/import_worker.h"

int main(int argc, char** argv) {
  if (const std::optional<int> worker = hydrostat::io::run_import_worker(argc, argv)) return *worker;
  std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is then an error of write(2), which is told with file and mend
  return hydrostat::cli::run(argc, argv, std::cerr);
}
