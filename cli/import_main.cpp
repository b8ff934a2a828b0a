#include <cstdio>

#include "io/import_worker.h"

/// The program that read_in_worker() starts where it lies beside the running one: without the libraries of the other stages
/// it starts in a tenth of the time.
int main(int argc, char** argv) {
  if (const std::optional<int> worker = hydrostat::io::run_import_worker(argc, argv)) return *worker;
  std::fputs("hydrostat-import: reads clip files for hydrostat, which starts it itself.\n", stderr);
  return 2;
}
