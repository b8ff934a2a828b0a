// Spoils clip files and our own text files by chance and asks that each is read to something sane or refused with a
// sentence.
//
//   clip_fuzz KIND FIRST COUNT FOUND_DIR FILE...     KIND: fbx, gltf, glb, bvh, dae; signals, body, scene, manifest; or
//   'cut'
//
// Case i of a kind is the same on every machine: FIRST and COUNT resume where a run ended. KIND 'cut' takes each file cut
// off after 1 KiB, 2 KiB and so on. What fails is kept in FOUND_DIR; the exit code tells whether anything did.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "io/batch_manifest.h"
#include "io/body_file.h"
#include "io/import.h"
#include "io/import_worker.h"
#include "io/scene_file.h"
#include "io/signals_file.h"
#include "io/stage_records.h"
#include "io/write_file.h"
#include "retarget/error.h"
#include "tests/fuzz/mutate.h"

namespace hydrostat {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr io::ReadLimits kLimits{.time_s = 5, .memory_gib = 1};
constexpr double kLongest = 3 * 5 + 2;       // [s]; reading, describing and a little
constexpr long kMostMemory = long{2} << 20;  // [KiB]
enum Outcome { kRead = 0, kRefused = 1, kUnsound = 3, kOddlyThrown = 4 };

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

int unsound(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  return kUnsound;
}

int check_character(const std::string& path) {
  io::Appearance looks;
  const retarget::Character character = io::import_character(path, "", {.limits = kLimits}, nullptr, &looks);
  if (!character.skin.vertices.allFinite()) return unsound("a vertex is not finite");
  for (const auto& frame : character.clip.bone_pose) {
    for (const Eigen::Affine3d& pose : frame) {
      if (!pose.matrix().allFinite()) return unsound("a bone's pose is not finite");
    }
  }
  for (const auto& influences : character.skin.skin_weights) {
    double sum = 0;
    for (const auto& influence : influences) sum += influence.weight;
    if (!(std::abs(sum - 1) < 1e-9)) return unsound("weights do not sum to 1");
  }
  if (character.skin.triangles.size() > 0 && character.skin.triangles.maxCoeff() >= character.skin.vertices.cols()) {
    return unsound("a triangle names a vertex that is not there");
  }
  try {
    const std::string worn = io::morphs_bytes({character.skin.morphs, character.clip.morph_weights});
    if (!character.skin.morphs.empty()) io::parse_morphs(worn, path, character.skin.vertices.cols());
  } catch (const Error&) {
    return unsound("its morph targets do not fit its skin");
  }
  for (int f = 0; f < character.clip.frames() && !character.skin.morphs.empty(); ++f) {
    if (!retarget::skin_positions(character, f).allFinite()) return unsound("a morphed vertex is not finite");
  }
  try {
    io::parse_appearance(io::appearance_bytes(looks), path, character.skin.vertices.cols());
  } catch (const Error&) {
    return unsound("its looks do not fit its skin");
  }
  for (const io::Appearance::Part& part : looks.parts) {
    for (const auto normal : part.normals.colwise()) {
      if (!(std::abs(normal.norm() - 1) < 1e-6)) return unsound("a normal is not of length 1");
    }
    for (const Eigen::Matrix2Xd& uvs : part.uvs) {
      if (!uvs.allFinite()) return unsound("a place in an image is not finite");
    }
  }
  return kRead;
}

int check_info(const std::string& path) {
  const io::FileInfo info = io::inspect(path, {.limits = kLimits});
  // What is not finite is written as null.
  const auto json = nlohmann::json::parse(io::to_json(info));
  for (const auto& clip : json.at("clips")) {
    if (clip.dump().find("null") != std::string::npos) return unsound("a clip has a number that is not finite");
  }
  return kRead;
}

int read_case(const std::string& kind, const std::string& path, bool whole_character) {
  try {
    if (kind == "signals") {
      io::read_signals(path);
    } else if (kind == "body") {
      retarget::Performer performer;
      io::parse_body(io::read_file(path), path, performer);
    } else if (kind == "scene") {
      io::read_scene_file(path);
    } else if (kind == "manifest") {
      io::read_batch_manifest(path);
    } else {
      return whole_character ? check_character(path) : check_info(path);
    }
    return kRead;
  } catch (const Error& error) {
    const bool told = std::strlen(error.what()) > 0 && !error.mend.empty();
    return told ? kRefused : unsound("the refusal does not tell what is wrong and how to mend it");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "thrown past the door: %s\n", error.what());
    return kOddlyThrown;
  }
}

/// Reads a case in a process of its own. What went wrong, or empty; `outcome` is what the process returned.
std::string run_case(const std::string& kind, const fs::path& file, bool whole_character, int& outcome) {
  const auto start = Clock::now();
  const pid_t child = fork();
  if (child == 0) _exit(read_case(kind, file.string(), whole_character));
  int status = 0;
  rusage used{};
  pid_t ended = 0;
  for (int polls = 0; ended == 0; ++polls) {
    ended = wait4(child, &status, WNOHANG, &used);
    if (ended != 0) break;
    if (std::chrono::duration<double>(Clock::now() - start).count() > kLongest) {
      kill(child, SIGKILL);
      wait4(child, &status, 0, &used);
      return "it hangs";
    }
    std::this_thread::sleep_for(std::chrono::microseconds(polls < 100 ? 300 : 3000));
  }
  if (WIFSIGNALED(status)) return std::string("ended by ") + strsignal(WTERMSIG(status));
  outcome = WEXITSTATUS(status);
  if (outcome != kRead && outcome != kRefused) return "it is let through unsound";
  if (used.ru_maxrss > kMostMemory) return "it takes " + std::to_string(used.ru_maxrss >> 10) + " MiB";
  return {};
}

struct Tally {
  long cases = 0, read = 0, refused = 0, found = 0;
};

class Fuzz {
 public:
  Fuzz(std::string kind, fs::path found, std::vector<fs::path> files)
      : kind_(std::move(kind)), found_(std::move(found)), files_(std::move(files)) {
    fs::create_directories(found_);
    std::string pattern = (fs::temp_directory_path() / "hydrostat_fuzz_XXXXXX").string();
    work_ = mkdtemp(pattern.data());
    for (const fs::path& file : files_) {
      originals_.push_back(contents(file));
      // glTF looks for its buffers beside it.
      const fs::path buffer = fs::path(file).replace_extension(".bin");
      if (file.extension() == ".gltf" && fs::exists(buffer)) fs::copy_file(buffer, work_ / buffer.filename());
    }
    for (const auto& entry : fs::directory_iterator(work_)) beside_ += entry.exists() ? 1 : 0;
  }
  ~Fuzz() { fs::remove_all(work_); }

  void mutate(std::uint64_t index) {
    std::uint64_t seed = 0xcbf29ce484222325 ^ index;
    for (const char letter : kind_) seed = (seed ^ static_cast<unsigned char>(letter)) * 0x100000001b3;
    const std::size_t which = static_cast<std::size_t>(index) % files_.size();
    run(Mutator(seed, originals_).mutate(originals_[which]), files_[which], index, index / files_.size() % 4 == 3);
  }

  void cut() {
    for (std::size_t f = 0; f < files_.size(); ++f) {
      for (std::size_t length = 1024; length < originals_[f].size(); length += 1024)
        run(originals_[f].substr(0, length), files_[f], length, false);
    }
  }

  const Tally& tally() const { return tally_; }

 private:
  void run(const std::string& bytes, const fs::path& original, std::uint64_t index, bool whole_character) {
    const fs::path file = work_ / ("case" + original.extension().string());
    std::ofstream(file, std::ios::binary) << bytes;
    int outcome = -1;
    std::string wrong = run_case(kind_, file, whole_character, outcome);
    long beside = 0;
    for (const auto& entry : fs::directory_iterator(work_)) beside += entry.exists() ? 1 : 0;
    if (wrong.empty() && beside != beside_ + 1) wrong = "a file was written";
    ++tally_.cases;
    tally_.read += outcome == kRead ? 1 : 0;
    tally_.refused += outcome == kRefused ? 1 : 0;
    if (!wrong.empty()) {
      ++tally_.found;
      const fs::path kept = found_ / (kind_ + "_" + std::to_string(index) + "_" + original.filename().string());
      fs::copy_file(file, kept, fs::copy_options::overwrite_existing);
      std::fprintf(stderr, "%s: %s\n", kept.c_str(), wrong.c_str());
    }
    fs::remove(file);
  }

  const std::string kind_;
  const fs::path found_;
  fs::path work_;
  std::vector<fs::path> files_;
  std::vector<std::string> originals_;
  long beside_ = 0;
  Tally tally_;
};

int run(int argc, char** argv) {
  if (argc < 6) {
    std::fputs("clip_fuzz KIND FIRST COUNT FOUND_DIR FILE...\n", stderr);
    return 2;
  }
  const std::string kind = argv[1];
  const std::uint64_t first = std::strtoull(argv[2], nullptr, 10), count = std::strtoull(argv[3], nullptr, 10);
  Fuzz fuzz(kind, argv[4], {argv + 5, argv + argc});
  if (kind == "cut") {
    fuzz.cut();
  } else {
    for (std::uint64_t i = first; i < first + count; ++i) fuzz.mutate(i);
  }
  const Tally& tally = fuzz.tally();
  std::printf("%s: %ld cases, %ld read, %ld refused, %ld found\n", kind.c_str(), tally.cases, tally.read, tally.refused,
              tally.found);
  return tally.found == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hydrostat

int main(int argc, char** argv) {
  if (const std::optional<int> worker = hydrostat::io::run_import_worker(argc, argv)) return *worker;
  return hydrostat::run(argc, argv);
}
