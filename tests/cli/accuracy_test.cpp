#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <sstream>

#include "cli/asked_accuracy.h"
#include "io/accuracy_page.h"
#include "io/label_places.h"
#include "tests/cli/run_program.h"
#include "tests/retarget/box_performer.h"
#include "tests/sanitizers.h"

namespace hydrostat::cli::accuracy_test {
namespace {

namespace fs = std::filesystem;

const char* const kFalling =
    "dimension = 2\nduration_s = 0.4\n[body]\nshape = \"bar\"\nsize_m = [0.6, 0.2]\nposition_m = [0.0, 0.15]\nnodes = "
    "12\nrotation_deg = "
    "10.0\n[ground]\n";

class AccuracyCommands : public testing::Test {
 protected:
  AccuracyCommands() { io::write_file(directory.path / "scene.toml", kFalling); }
  Outcome run(const std::string& arguments) const { return hydrostat_in(directory.path, arguments); }
  nlohmann::json report(const std::string& out) const {
    return nlohmann::json::parse(io::read_file(directory.path / out / "report.json"));
  }
  TemporaryDirectory directory;
};

TEST_F(AccuracyCommands, BenchWritesTheCurve) {
  const Outcome outcome = run("bench accuracy scene.toml -o out --own-mesh --duration 0.2 --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["schema"], "hydrostat.accuracy/1");
  const std::string csv = io::read_file(directory.path / "out" / "accuracy.csv");
  EXPECT_EQ(
      csv.substr(0, csv.find('\n')),
      "method,element,nodes,dt_s,iterations,harmonics,error_rms_m,error_rel_length,ms_per_sim_s,volume_error,momentum_error,"
      "angular_error,stable");
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), json["rows"].size() + 1);
  const std::string page = io::read_file(directory.path / "out" / "accuracy.html");
  for (std::size_t k = 0; k < json["rows"].size(); ++k) {  // each point that is drawn leads to its row
    if (!json["rows"][k]["stable"]) continue;
    EXPECT_NE(page.find("href=\"#row" + std::to_string(k) + "\""), std::string::npos);
    EXPECT_NE(page.find("id=\"row" + std::to_string(k) + "\""), std::string::npos);
  }
  const int chosen = json["recommended"];
  ASSERT_GE(chosen, 0);
  const auto& best = json["rows"][static_cast<std::size_t>(chosen)];
  EXPECT_LE(best["error_rel_length"], json["max_error"]);
  for (const auto& row : json["rows"]) {  // by the time that the picture shows
    if (row["stable"] && row["error_rel_length"] <= json["max_error"]) {
      EXPECT_GE(row["ms_per_sim_s"], best["ms_per_sim_s"]);
    }
  }
  EXPECT_NE(page.find("Ringed: the least processor time within"), std::string::npos);
}

TEST_F(AccuracyCommands, SimulateTakesTheCheapestWithinTheErrorAndTellsIt) {
  ASSERT_EQ(run("simulate scene.toml -o fine --max-error 0.5% --quiet").exit_code, 0);
  ASSERT_EQ(run("simulate scene.toml -o draft --accuracy draft --quiet").exit_code, 0);
  const auto fine = report("fine")["accuracy"], draft = report("draft")["accuracy"];
  EXPECT_LE(fine["estimated_error_length"], 0.005);
  EXPECT_LE(draft["estimated_error_length"], 0.05);
  EXPECT_EQ(fine["max_error_length"], 0.005);
  EXPECT_GE(draft["work_saved"], fine["work_saved"]);
  EXPECT_TRUE(fs::exists(directory.path / "fine" / "accuracy.svg"));
  EXPECT_NE(io::read_file(directory.path / "fine" / "report.html").find("What accuracy costs: "), std::string::npos);
  ASSERT_EQ(run("simulate scene.toml -o again --max-error 0.5% --quiet").exit_code, 0);
  EXPECT_EQ(report("again")["accuracy"]["method"], fine["method"]);
  EXPECT_EQ(report("again")["accuracy"]["dt_s"], fine["dt_s"]);
}

TEST_F(AccuracyCommands, RefuseWhatCannotBeToldAndTellWhatIsPossible) {
  const Outcome too_small = run("simulate scene.toml -o out --max-error 0.00001% --quiet");
  EXPECT_EQ(too_small.exit_code, 2);
  EXPECT_NE(too_small.err.find("the reference itself is only known within"), std::string::npos) << too_small.err;
  EXPECT_FALSE(fs::exists(directory.path / "out"));
  const Outcome short_of_it = run("simulate scene.toml -o out --method euler --max-error 0.25% --quiet");
  EXPECT_EQ(short_of_it.exit_code, 3);
  EXPECT_NE(short_of_it.err.find("no setting that was tried stays within"), std::string::npos) << short_of_it.err;
  EXPECT_TRUE(fs::exists(directory.path / "out" / "failed.glb"));
  EXPECT_FALSE(fs::exists(directory.path / "out" / "replay.glb"));
  EXPECT_GT(report("out")["accuracy"]["estimated_error_length"], 0.0025);
  EXPECT_EQ(run("simulate scene.toml -o out --max-error 70% --quiet").exit_code, 2);
  EXPECT_EQ(run("simulate scene.toml -o out --max-error 1% --accuracy draft --quiet").exit_code, 2);
}

TEST_F(AccuracyCommands, TellOfHowMuchOfTheRunTheErrorIs) {
  const std::string floating = "dimension = 2\nduration_s = 3.0\ngravity_m_s2 = [0.0, 0.0]\n[body]\nshape = \"bar\"\nsize_m = [0.6, 0.2]\nnodes = 12\nspin_deg_s = 90.0\n";
  io::write_file(directory.path / "floating.toml", floating);
  const Outcome outcome = run("simulate floating.toml -o asked --max-error 2% --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("% of L over 3 s"), std::string::npos) << outcome.out;
  EXPECT_NEAR(report("asked")["accuracy"]["estimated_span_s"], 3, 1e-9);
  ASSERT_EQ(run("simulate floating.toml -o given --quiet").exit_code, 0);
  EXPECT_NEAR(report("given")["accuracy"]["estimated_span_s"], 3, 1e-9);
  ASSERT_EQ(run("simulate scene.toml -o touching --quiet").exit_code, 0);
  EXPECT_NEAR(report("touching")["accuracy"]["estimated_span_s"], 0.1, 1e-9);  // of every window
}

/// A bar that is pulled down: the jerk breaks its seam, but long steps of euler damp it.
std::string jerked_bar(double strength, const std::string& steps) {
  return "dimension = 2\nduration_s = 1.0\n" + steps +
         "[body]\nshape = \"bar\"\nsize_m = [0.2, 0.6]\nnodes = 24\nposition_m = [0.0, 1.0]\n"
         "[material]\nyoungs_modulus_pa = 2e5\ndamping_time_s = 0.005\n[[clamp]]\nnormal = [0.0, 1.0]\noffset_m = 0.29\n"
         "[[push]]\ntime_s = 0.1\nduration_s = 0.03\ndelta_v_m_s = [0.0, -1.0]\n[[seam]]\nnormal = [0.0, 1.0]\nstrength_pa = " +
         std::to_string(strength) + "\n";
}

TEST_F(AccuracyCommands, TakeNoStepByWhichABodyBreaksOtherwiseAndWarnOfOneThatIsGiven) {
  const std::string warning = "by 'euler' in steps of 0.0333 s the body does not break, by 'explicit' in steps of ";
  for (int seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const double strength = 1.1e4 + 1.2e3 * seed;
    io::write_file(directory.path / "plain.toml", jerked_bar(strength, ""));
    io::write_file(directory.path / "rough.toml", jerked_bar(strength, "method = \"euler\"\ndt_s = 0.0333333333\n"));
    ASSERT_EQ(run("simulate plain.toml -o plain --quiet").exit_code, 0);
    ASSERT_EQ(report("plain")["simulation"]["pieces_end"], 2);
    EXPECT_EQ(report("plain")["warnings"].dump().find("the body"), std::string::npos);
    const double breaks_s = report("plain")["simulation"]["fractures"][0]["time_s"];
    const Outcome rough = run("simulate rough.toml -o rough --quiet");
    ASSERT_EQ(report("rough")["simulation"]["pieces_end"], 1);
    EXPECT_NE(rough.out.find(warning), std::string::npos) << rough.out;
    EXPECT_NE(report("rough")["warnings"].dump().find(warning), std::string::npos);
    for (const char* scene : {"plain.toml", "rough.toml"}) {  // of all methods, and of euler alone
      const Outcome draft = run(std::string("simulate ") + scene + " -o draft --accuracy draft --quiet");
      EXPECT_EQ(draft.exit_code, 0) << draft.err;
      const nlohmann::json found = report("draft");
      EXPECT_EQ(found["simulation"]["pieces_end"], 2) << scene;
      EXPECT_NEAR(found["simulation"]["fractures"][0]["time_s"], breaks_s, 2 * 0.0334) << scene;  // each within a frame of the truth
      EXPECT_NE(found["warnings"].dump().find("the error is that of the motion before"), std::string::npos);
      // What the page tells is of the whole run, of which most is spent in parts that touch each other.
      EXPECT_NEAR(found["accuracy"]["estimated_span_s"], std::floor(30 * breaks_s) / 30, 0.034);
    }
  }
  io::write_file(directory.path / "strong.toml", jerked_bar(1.4e4, "method = \"euler\"\n"));  // no step of euler breaks it
  const Outcome none = run("simulate strong.toml -o none --accuracy draft --quiet");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.err.find("and breaks, or stays up, as in finer steps"), std::string::npos) << none.err;
  EXPECT_NE(report("none")["warnings"].dump().find("the body does not break"), std::string::npos);
}

TEST_F(AccuracyCommands, TakeNoStepByWhichASeamStaysWholeThatTearsInPart) {
  for (const char* strength : {"2.7e3", "2.8e3"}) {
    SCOPED_TRACE(strength);
    // The end behind the first seam bends by its muscles, which tears half of it.
    io::write_file(directory.path / "bent.toml",
                   std::string("duration_s = 0.6\ngravity_m_s2 = [0.0, 0.0, 0.0]\n[body]\nshape = \"bar\"\nsize_m = [0.8, 0.2, 0.2]\n"
                               "cell_size_m = 0.1\n[material]\nyoungs_modulus_pa = 2e5\ndamping_time_s = 0.01\n"
                               "[[seam]]\nnormal = [1.0, 0.0, 0.0]\noffset_m = 0.2\nstrength_pa = ") +
                       strength +
                       "\n[[seam]]\nnormal = [1.0, 0.0, 0.0]\noffset_m = -0.2\nstrength_pa = 3e3\n"
                       "[[activation]]\naxis = [0.0, 1.0, 0.0]\nbox_m = [[0.05, -0.1, -0.1], [0.4, 0.1, 0.1]]\namplitude = 0.3\nfrequency_hz = 2.0\n"
                       "[[activation]]\naxis = [1.0, 0.0, 0.0]\nbox_m = [[-0.4, -0.1, -0.1], [-0.05, 0.1, 0.1]]\namplitude = 0.12\n"
                       "frequency_hz = 2.0\nphase_deg = 0.0\n");
    const auto torn = [&](const std::string& out) {
      std::map<int, int> faces;
      const nlohmann::json fractures = report(out)["simulation"]["fractures"];
      for (const auto& one : fractures) faces[one["seam"]] += one["faces"].get<int>();
      return faces;
    };
    ASSERT_EQ(run("simulate bent.toml -o plain --quiet").exit_code, 0);
    ASSERT_EQ(report("plain")["simulation"]["pieces_end"], 1);
    ASSERT_FALSE(torn("plain").empty());
    const Outcome draft = run("simulate bent.toml -o draft --accuracy draft --quiet");
    EXPECT_EQ(draft.exit_code, 0) << draft.err;
    EXPECT_EQ(torn("draft"), torn("plain"));
  }
}

/// All told in counted work: the clock has no say.
TEST(ChosenStep, OfADraftCostsLessThanOfAFinalAndBothKeepTheirError) {
  const retarget::Performer performer = retarget::make_box_performer();
  const retarget::SignalSet signals = retarget::signals_of(performer);
  const auto choose = [&](const std::string& grade) {
    ChosenStep chosen = choose_step({"", grade}, "hydrostat convert", performer, signals, std::nullopt);
    EXPECT_TRUE(chosen.report.is_met()) << grade;
    EXPECT_LE(chosen.report.estimated_error_length, chosen.report.max_error_length) << grade;
    const retarget::AccuracyRow& row = chosen.curve.rows.at(static_cast<std::size_t>(chosen.curve.recommended));
    EXPECT_GE(row.error_rms_m, row.loop_error_m) << grade;
    EXPECT_NEAR(chosen.report.estimated_error_length, row.error_rel_length + chosen.curve.floor, 1e-12) << grade;
    return chosen;
  };
  const auto work_ms = [](const ChosenStep& chosen) { return chosen.curve.rows.at(static_cast<std::size_t>(chosen.curve.recommended)).work_ms; };
  const ChosenStep draft = choose("draft"), finest = choose("final");
  EXPECT_GT(draft.report.max_error_length, 10 * finest.report.max_error_length);
  EXPECT_LT(work_ms(draft), work_ms(finest));                          // the motion
  EXPECT_LT(draft.reference->work_ms, finest.reference->work_ms);      // what it is held against
  EXPECT_LE(draft.curve.rows.size(), finest.curve.rows.size());        // and how much is tried
}

TEST_F(AccuracyCommands, RefuseAnEmptyError) {
  for (const char* command : {"simulate scene.toml -o out --max-error ''", "bench accuracy scene.toml -o out --max-error ''",
                              "replay creature --max-error ''", "replay creature --lod ''"}) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_NE(outcome.err.find("is empty"), std::string::npos) << outcome.err;
  }
}

TEST(AccuracyCurve, CrossesOutWhatTheClosedLoopRefusedAndIsDrawnOverWhatItWasChosenBy) {
  retarget::AccuracyRow good;
  good.method = "explicit";
  good.error_rms_m = good.error_rel_length = good.loop_error_m = 0.005;
  good.ms_per_sim_s = 10;
  good.work_ms = 3;
  retarget::AccuracyRow refused = good;
  refused.method = "spring";
  refused.work_ms = 2;
  refused.loop_error_m = 0.03;
  refused.is_refused = true;
  io::AccuracyCurve curve;
  curve.rows = {good, good};
  curve.recommended = 0;
  curve.max_error = 0.01;
  curve.is_counted = true;
  EXPECT_EQ(io::accuracy_page(curve).find("refused"), std::string::npos);
  curve.rows[1] = refused;
  const std::string page = io::accuracy_page(curve);
  EXPECT_NE(page.find("Ringed: the least work within"), std::string::npos);
  EXPECT_NE(page.find("<td>refused"), std::string::npos);
  EXPECT_NE(page.find("of L, closed loop too"), std::string::npos);
  EXPECT_NE(page.find(" 3 ms a second"), std::string::npos);
  EXPECT_EQ(page.find(" 10 ms a second"), std::string::npos);
  const auto rows = nlohmann::json::parse(io::accuracy_json(curve))["rows"];
  EXPECT_EQ(rows[1]["refused"], true);
  EXPECT_EQ(rows[1]["loop_error_m"], 0.03);
  EXPECT_EQ(rows[1]["on_front"], false);
  EXPECT_EQ(rows[0]["on_front"], true);
}

TEST_F(AccuracyCommands, ExplainTellsEveryEffectOnceWithItsReason) {
  const Outcome outcome = run("explain scene.toml --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto effects = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(effects.size(), 13U);
  for (const auto& effect : effects) {
    EXPECT_NE(effect["reason"], "");
    if (effect["state"] == "off") {
      EXPECT_EQ(effect["ms_per_sim_s"], 0) << effect["name"];
    }
  }
  EXPECT_EQ(run("bench effects scene.toml -o bench --duration 0.1").exit_code, 0);
  EXPECT_TRUE(fs::exists(directory.path / "bench" / "effects.html"));
}

/// Instructions of the steps and of what effects add to them, as valgrind counts them; what is outside allocates, and the
/// heap is never twice the same.
double instructions(const fs::path& directory, const std::string& scene) {
  const std::string command =
      "cd '" + directory.string() +
      "' && valgrind --tool=callgrind --callgrind-out-file=counts "
      "--toggle-collect='*GuardedStepper<*>::step(*' --toggle-collect='*FluidEffect<*>::add_forces(*' "
      "--toggle-collect='*Tearing<*>::break_loaded(*' "
      "'" HYDROSTAT_BINARY "' simulate " +
      scene + " -o out --threads 1 --quiet >log 2>&1";
  if (std::system(command.c_str()) != 0) return -1;
  std::istringstream text(io::read_file(directory / "counts"));
  for (std::string word; text >> word;) {
    if (word == "summary:" || word == "totals:") return text >> word ? std::stod(word) : -1;
  }
  return -1;
}

TEST_F(AccuracyCommands, EffectsThatAreOffCostNoInstruction) {
  if (kSanitized || std::system("valgrind --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "valgrind is not installed";
  const std::string shape = "dimension = 2\nduration_s = 0.02\n[body]\nshape = \"square\"\nsize_m = 0.4\nnodes = 9\n";
  const struct {
    std::string text, effect;
    double least_share;  // of the plain scene's instructions, that it takes more where it is on
  } effects[] = {{"[water]\n", "water", 0.01},
                 {"[ground]\nheight_m = -0.2\n", "ground", 0.001},
                 {"[[obstacle]]\nshape = \"box\"\nsize_m = [0.2, 0.2]\nposition_m = [0.0, -0.32]\n", "obstacles", 0.001},
                 {"[[push]]\ntime_s = 0.0\ndelta_v_m_s = [1.0, 0.0]\n", "pushes", 0.001},
                 {"", "self_contact", 0.001},
                 {"[[seam]]\nnormal = [0.0, 1.0]\n", "fracture", 0.01}};
  io::write_file(directory.path / "plain.toml", shape);
  const double plain = instructions(directory.path, "plain.toml");
  ASSERT_GT(plain, 1e5);
  std::string all = shape + "[air]\nvelocity_m_s = [30.0, 0.0]\n", off = "[effects]\nair_drag = \"off\"\n";
  for (const auto& [text, effect, least_share] : effects) {
    SCOPED_TRACE(effect);
    all += text;
    off += effect + " = \"off\"\n";
    io::write_file(directory.path / "on.toml", shape + text + "[effects]\n" + effect + " = \"on\"\n");
    EXPECT_GT(instructions(directory.path, "on.toml"), (1 + least_share) * plain);
  }
  io::write_file(directory.path / "off.toml", all + off);
  EXPECT_NEAR(instructions(directory.path, "off.toml"), plain, 1e-3 * plain);
}

/// The boxes of the picture's texts [px], as wide as letters of a usual font are, and of its points.
struct PictureBoxes {
  std::vector<io::Box> texts, points;
};
PictureBoxes boxes_of(const std::string& svg) {
  PictureBoxes boxes;
  const std::regex text("<text ([^>]*)>([^<]*)</text>"), entity("&[^;]*;"), circle("<circle cx=\"([^\"]*)\" cy=\"([^\"]*)\"");
  for (std::sregex_iterator at(svg.begin(), svg.end(), text), end; at != end; ++at) {
    const std::string attributes = (*at)[1], letters = std::regex_replace((*at)[2].str(), entity, "o");
    const auto has = [&](const std::string& words) { return attributes.find(words) != std::string::npos; };
    const auto number = [&](const std::string& name) {
      const std::size_t begin = attributes.find(name + "=\"");
      return begin == std::string::npos ? 0 : std::stod(attributes.substr(begin + name.size() + 2));
    };
    if (has("transform")) continue;  // the title of the upright axis, along the edge
    const double size = has("font-size") ? number("font-size") : 11, width = 0.55 * size * static_cast<double>(letters.size());
    const double shift = has("middle") ? width / 2 : has("\"end\"") ? width : 0, left = number("x") - shift, base = number("y");
    boxes.texts.push_back({left, base - 0.75 * size, left + width, base + 0.2 * size});
  }
  for (std::sregex_iterator at(svg.begin(), svg.end(), circle), end; at != end; ++at) {
    const double x = std::stod((*at)[1]), y = std::stod((*at)[2]);
    boxes.points.push_back({x - 4, y - 4, x + 4, y + 4});
  }
  return boxes;
}

TEST(AccuracyPicture, PrintsNoTextOverAnotherNorOverAPoint) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto any = [&](double least, double most) { return std::uniform_real_distribution<double>(least, most)(random); };
    const double decades = seed % 3 == 0 ? 0.05 : any(0.2, 4);  // all in one place, or far apart
    const int rows = 2 + static_cast<int>(seed % 24);
    io::AccuracyCurve curve;
    curve.floor = seed % 2 == 0 ? 0 : std::pow(10, any(-4, -1));
    int falling = 0;
    for (int k = 0; k < rows; ++k) {
      retarget::AccuracyRow row;
      row.method = std::vector<std::string>{"explicit", "implicit", "euler", "xpbd", "spring"}[random() % 5];
      row.nodes = 10 + static_cast<int>(random() % 2000);
      row.falls = k < 2 || random() % 3 == 0;
      row.stable = !row.falls;
      row.work_ms = row.ms_per_sim_s = 30 * std::pow(10, any(0, decades));
      row.error_rel_length = row.error_rms_m = 0.01 * std::pow(10, any(-decades, 0));
      if (k == 1) row = curve.rows[0];  // twice the same, by another step
      falling += row.falls ? 1 : 0;
      curve.rows.push_back(row);
    }
    const std::string svg = io::accuracy_svg(curve);
    const PictureBoxes boxes = boxes_of(svg);
    int told = 0;
    for (std::size_t at = svg.find(" nodes: falls<"); at != std::string::npos; at = svg.find(" nodes: falls<", at + 1)) ++told;
    EXPECT_EQ(told, falling);
    for (std::size_t a = 0; a < boxes.texts.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(boxes.texts[a].meets(boxes.texts[b])) << svg;
      for (const io::Box& point : boxes.points) EXPECT_FALSE(boxes.texts[a].meets(point)) << svg;
    }
  }
}

}  // namespace
}  // namespace hydrostat::cli::accuracy_test
