#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command_line.h"
#include "cli/conversion.h"
#include "cli/outcome.h"
#include "cli/subcommands.h"
#include "io/import.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

io::ImportedCharacter import(const ConvertOptions& options) {
  io::ImportedCharacter imported;
  io::ImportOptions import_options = options.import;
  import_options.sample_rate_hz = retarget::CreatureOptions().rate_hz;
  imported.character = io::import_character(options.clip_file, options.clip, import_options, &imported.warnings,
                                             &imported.appearance);
  return imported;
}

int convert(const ConvertOptions& options) {
  const double limit = wished_limit(options);
  const retarget::CreatureOptions settings = creature_options(options);
  // Refused now, not after the body is made.
  exports_of(options);
  if (options.accuracy.is_asked()) options.accuracy.most("hydrostat convert");
  Progress progress(std::cerr, progress_style(options.quiet));
  Stages stages(progress);
  const io::ImportedCharacter imported = stages.run("import", [&] { return import(options); });
  io::CreatureWriter writer(options.out, io::CreatureWriter::Start::afresh);
  stages.use_cache(writer.cache_directory());
  Conversion conversion(options, settings, stages, writer);
  try {
    conversion.run(imported, limit);
  } catch (const UsageError&) {  // of no file
    throw;
  } catch (const Error& error) {
    throw writer.as_seen(error);
  }
  writer.commit();
  note_warnings(progress, conversion.report().warnings);
  const retarget::Replay& run = conversion.performances().main();
  const std::string motion_file = (fs::path(options.out) / "failed.glb").string();
  const std::string way_up = is_down(run) ? "try " + change_of_conversion(run) : "";
  const int exit_code =
      options.json ? tell_report(run, options.out, motion_file, conversion.report(), way_up) : tell_run(run, options.out, motion_file, way_up);
  const retarget::AccuracyReport& accuracy = conversion.report().accuracy;
  if (!options.json) std::cout << saved_words(conversion.report());
  if (exit_code != kDone || accuracy.is_met()) return exit_code;
  std::cerr << too_inaccurate(options.clip_file, accuracy) << std::endl;
  return kShortOfTarget;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* convert_command = app.add_subcommand("convert", "Make a creature of a clip: a soft body that performs it by itself");
  add_convert_options(*convert_command, *options);
  convert_command->callback([options, &exit_code] { exit_code = convert(*options); });
}

}  // namespace hydrostat::cli
