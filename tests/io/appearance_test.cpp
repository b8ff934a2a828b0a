#include "io/appearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "io/gltf_out.h"
#include "io/images.h"
#include "io/import.h"
#include "io/read_scene.h"
#include "io/stage_records.h"
#include "tests/io/temporary_directory.h"
#include "tests/io/tiny_gltf_file.h"

namespace hydrostat::io::appearance_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kFloat = 5126;
/// One pixel.
constexpr std::string_view kPng =
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d4944415478da6364f8cf500f00038601805a34"
    "7d6b0000000049454e44ae426082";

std::string png() {
  std::string bytes;
  for (std::size_t i = 0; i < kPng.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(kPng.substr(i, 2)), nullptr, 16));
  return bytes;
}

/// The strip's vertices twice, the lower half on the first six, the upper on the others, which lie elsewhere in the image:
/// a seam at y = 1. The upper half may have a material of its own.
struct SeamedStrip {
  bool two_materials = false, with_normals = true;
  Json materials = Json::array({{{"name", "fur"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
  Json images = Json::array({{{"uri", "fur.png"}}});
  Json textures = Json::array({{{"source", 0}}});
  Json samplers = Json::array();

  TinyGltf file() const {
    TinyGltf tiny;
    tiny.amend = [*this](Json& file, GltfBuffer& buffer) {
      std::vector<float> places, normals, colours, positions, weights;
      std::vector<std::uint8_t> joints;
      for (int half = 0; half < 2; ++half) {
        for (int v = 0; v < 6; ++v) {
          const auto row = static_cast<float>(v / 2), column = static_cast<float>(v % 2);
          positions.insert(positions.end(), {0.2f * column - 0.1f, row, 0});
          joints.insert(joints.end(), {0, 1, 0, 0});
          weights.insert(weights.end(), {v < 2 ? 1.0f : 0, v < 2 ? 0 : 1.0f, 0, 0});
          places.insert(places.end(), {0.25f * column + 0.5f * static_cast<float>(half), 0.5f * row});
          normals.insert(normals.end(), {0, 0, 1});
          colours.insert(colours.end(), {1, 0.5f, static_cast<float>(half), 1});
        }
      }
      Json attributes{{"POSITION", buffer.add(positions, kFloat, "VEC3", 3)},
                      {"JOINTS_0", buffer.add(joints, 5121, "VEC4", 4)},
                      {"WEIGHTS_0", buffer.add(weights, kFloat, "VEC4", 4)},
                      {"TEXCOORD_0", buffer.add(places, kFloat, "VEC2", 2)},
                      {"COLOR_0", buffer.add(colours, kFloat, "VEC4", 4)}};
      if (with_normals) attributes["NORMAL"] = buffer.add(normals, kFloat, "VEC3", 3);
      const int low = buffer.add(std::vector<std::uint8_t>{0, 1, 3, 0, 3, 2}, 5121, "SCALAR", 1);
      const int high = buffer.add(std::vector<std::uint8_t>{8, 9, 11, 8, 11, 10}, 5121, "SCALAR", 1);
      const int both = buffer.add(std::vector<std::uint8_t>{0, 1, 3, 0, 3, 2, 8, 9, 11, 8, 11, 10}, 5121, "SCALAR", 1);
      Json& primitives = file["meshes"][0]["primitives"];
      const auto primitive = [&](int indices, int material) {
        return Json{{"attributes", attributes}, {"indices", indices}, {"material", material}};
      };
      primitives = two_materials ? Json::array({primitive(low, 0), primitive(high, 1)}) : Json::array({primitive(both, 0)});
      file["materials"] = materials;
      file["images"] = images;
      file["textures"] = textures;
      if (!samplers.empty()) file["samplers"] = samplers;
    };
    return tiny;
  }
};

struct Read {
  retarget::Character character;
  Appearance appearance;
  std::vector<std::string> warnings;
};

Read read(const TinyGltf& file, const fs::path& directory) {
  Read result;
  result.character = import_character(file.write(directory.string()), "", {}, &result.warnings, &result.appearance);
  return result;
}

void put(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

/// A body with a node at each vertex of the skin, which rises by a metre.
void write(const fs::path& path, const Read& read) {
  const Eigen::Matrix3Xd& vertices = read.character.skin.vertices;
  retarget::ControlMesh body;
  body.nodes = vertices;
  retarget::Embedding embedding;
  embedding.nodes = Eigen::Matrix4Xi::Zero(4, vertices.cols());
  embedding.weights = Eigen::Matrix4Xd::Zero(4, vertices.cols());
  embedding.nodes.row(0) = Eigen::RowVectorXi::LinSpaced(vertices.cols(), 0, static_cast<int>(vertices.cols()) - 1);
  embedding.weights.row(0).setOnes();
  retarget::Motion motion;
  motion.frames.resize(vertices.size(), 2);
  motion.at(0) = vertices;
  motion.at(1) = vertices.colwise() + Eigen::Vector3d::UnitY();
  write_skinned_glb(path, {vertices, read.character.skin.triangles, embedding, &read.appearance}, body,
                    Eigen::VectorXd::Ones(vertices.cols()), motion, {});
}

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Everything that glTF 2.0 says of a material, and three extensions.
SeamedStrip strip_with_all() {
  SeamedStrip strip;
  strip.two_materials = true;
  strip.materials = Json::parse(R"([
    {"name": "fur", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 0.25, 0],
     "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.8, 0.7, 0.6], "metallicFactor": 0.3, "roughnessFactor": 0.4,
       "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3]}}},
       "metallicRoughnessTexture": {"index": 1}},
     "normalTexture": {"index": 1, "scale": 0.5}, "occlusionTexture": {"index": 0, "strength": 0.75},
     "emissiveTexture": {"index": 1}, "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
    {"name": "eyes", "alphaMode": "BLEND", "extensions": {"KHR_materials_unlit": {}}}])");
  strip.images = Json::array({{{"uri", "fur.png"}}, {{"uri", "light%20map.png"}}});
  strip.textures = Json::array({{{"source", 0}, {"sampler", 0}}, {{"source", 1}}});
  strip.samplers = Json::array({{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}, {"minFilter", 9986}}});
  return strip;
}

TEST(Appearance, ASeamInTheImageIsDrawnTwiceOnOneVertexOfTheSkin) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  for (const bool two_materials : {false, true}) {
    SeamedStrip strip;
    strip.two_materials = two_materials;
    if (two_materials) strip.materials.push_back({{"name", "eyes"}});
    const Read got = read(strip.file(), directory.path);
    EXPECT_EQ(got.character.skin.vertices.cols(), 6);
    ASSERT_EQ(got.appearance.parts.size(), two_materials ? 2u : 1u);
    Eigen::Index drawn = 0, triangles = 0;
    for (const Appearance::Part& part : got.appearance.parts) {
      drawn += part.vertices.size();
      triangles += part.triangles.cols();
      for (Eigen::Index d = 0; d < part.vertices.size(); ++d) {
        const Eigen::Vector3d place = got.character.skin.vertices.col(part.vertices[d]);
        const double half = part.colours(2, d), column = place.x() > 0 ? 1 : 0;
        EXPECT_LT((part.normals.col(d) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
        EXPECT_NEAR(part.colours(1, d), 0.5, 1e-7);
        if (part.uvs.empty()) continue;  // the second material shows no image
        EXPECT_LT((part.uvs[0].col(d) - Eigen::Vector2d(0.25 * column + 0.5 * half, 0.5 * place.y())).norm(), 1e-6);
      }
    }
    EXPECT_EQ(drawn, 8);
    EXPECT_EQ(triangles, 4);
    ASSERT_EQ(got.appearance.images.size(), 1u);
    EXPECT_EQ(got.appearance.images[0].bytes, png());
    EXPECT_TRUE(got.warnings.empty());
  }
}

TEST(Appearance, AMaterialComesBackFromTheWrittenFileAsItWas) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  put(directory.path / "light map.png", png());
  const Read got = read(strip_with_all().file(), directory.path);
  EXPECT_TRUE(got.warnings.empty());
  write(directory.path / "written.glb", got);
  const Scene written = read_gltf(directory.path / "written.glb");
  ASSERT_EQ(written.materials.size(), 2u);
  for (std::size_t m = 0; m < 2; ++m) {
    const Material &a = got.appearance.materials[m], &b = written.materials[m];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.base_colour, b.base_colour);
    EXPECT_EQ(a.metallic, b.metallic);
    EXPECT_EQ(a.roughness, b.roughness);
    EXPECT_EQ(a.emissive, b.emissive);
    EXPECT_EQ(a.alpha_mode, b.alpha_mode);
    EXPECT_EQ(a.alpha_cutoff, b.alpha_cutoff);
    EXPECT_EQ(a.double_sided, b.double_sided);
    EXPECT_EQ(a.unlit, b.unlit);
    for (std::size_t k = 0; k < maps_of(a).size(); ++k) {
      const TextureMap &x = *maps_of(a)[k], &y = *maps_of(b)[k];
      EXPECT_EQ(x.image, y.image);
      EXPECT_EQ(x.uv_set, y.uv_set);
      EXPECT_EQ(x.strength, y.strength);
      EXPECT_EQ(x.offset, y.offset);
      EXPECT_EQ(x.scale, y.scale);
      EXPECT_EQ(x.turn, y.turn);
      EXPECT_EQ(x.wrap_u, y.wrap_u);
      EXPECT_EQ(x.wrap_v, y.wrap_v);
      EXPECT_EQ(x.magnify_filter, y.magnify_filter);
      EXPECT_EQ(x.minify_filter, y.minify_filter);
    }
  }
  const Material& fur = written.materials[0];
  EXPECT_EQ(fur.base_colour, Eigen::Vector4d(0.9, 0.8, 0.7, 0.6));
  EXPECT_EQ(fur.emissive, Eigen::Vector3d(2, 1, 0));
  EXPECT_EQ(fur.base_colour_map.scale, Eigen::Vector2d(2, 3));
  EXPECT_EQ(fur.base_colour_map.wrap_v, 33648);
  EXPECT_EQ(fur.normal_map.strength, 0.5);
  EXPECT_EQ(fur.occlusion_map.strength, 0.75);
  EXPECT_TRUE(written.materials[1].unlit);
  ASSERT_EQ(written.images.size(), 2u);
  for (const Image& image : written.images) EXPECT_EQ(image.bytes, png());
  ASSERT_EQ(written.meshes.size(), 2u);
  EXPECT_EQ(written.meshes[0].colours.cols(), 4);
  EXPECT_LT((written.meshes[0].uvs[0] - got.appearance.parts[0].uvs[0]).norm(), 1e-6);
}

TEST(Appearance, TheValidatorFindsNothingInWhatIsWrittenAndItsBytesAreAlwaysTheSame) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  put(directory.path / "light map.png", png());
  SeamedStrip flat;
  flat.with_normals = false;
  const Read all = read(strip_with_all().file(), directory.path);
  write(directory.path / "all.glb", all);
  write(directory.path / "again.glb", all);
  write(directory.path / "flat.glb", read(flat.file(), directory.path));
  EXPECT_EQ(bytes_of(directory.path / "all.glb"), bytes_of(directory.path / "again.glb"));
  const std::string command = "NODE_PATH='" HYDROSTAT_NODE_MODULES "' node '" HYDROSTAT_TESTS "/io/validate_glb.cjs' '" +
                              (directory.path / "all.glb").string() + "' '" + (directory.path / "flat.glb").string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_gltf(directory.path / "flat.glb").meshes.at(0).normals.cols(), 0) << "flat in glTF is to have no normals";
}

TEST(Appearance, TangentsRunAlongTheImageOnEitherSideOfAMirror) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  put(directory.path / "light map.png", png());
  const Read got = read(strip_with_all().file(), directory.path);
  const Appearance::Part& part = got.appearance.parts.at(0);
  ASSERT_EQ(part.tangents.cols(), part.vertices.size());
  // u runs along x and v up the strip, where glTF's v runs downward: mirrored.
  for (const auto tangent : part.tangents.colwise()) EXPECT_LT((tangent - Eigen::Vector4d(1, 0, 0, -1)).norm(), 1e-6);
}

TEST(Appearance, ATextureThatCannotBeHadIsOneWarningWithItsNameAndTheColourStays) {
  const TemporaryDirectory outside, directory;
  put(outside.path / "secret.png", png());
  put(directory.path / "letter.png", "Dear reader");
  put(directory.path / "cut.png", png().substr(0, 50));
  fs::create_symlink(outside.path / "secret.png", directory.path / "link.png");
  const std::string above = "../" + outside.path.filename().string() + "/secret.png";
  for (const std::string& name : {std::string("absent.png"), std::string("letter.png"), std::string("cut.png"),
                                  std::string("link.png"), above, (outside.path / "secret.png").string()}) {
    SCOPED_TRACE(name);
    SeamedStrip strip = strip_with_all();
    strip.two_materials = false;
    strip.images = Json::array({{{"uri", name}}, {{"uri", name}}});
    strip.textures[1]["source"] = 0;
    const Read got = read(strip.file(), directory.path);
    ASSERT_EQ(got.warnings.size(), 1u);
    EXPECT_NE(got.warnings[0].find("'" + name + "'"), std::string::npos) << got.warnings[0];
    EXPECT_TRUE(got.appearance.images.empty());
    EXPECT_EQ(got.appearance.materials.at(0).base_colour, Eigen::Vector4d(0.9, 0.8, 0.7, 0.6));
    for (const TextureMap* map : maps_of(got.appearance.materials[0])) EXPECT_EQ(map->image, -1);
  }
}

TEST(Appearance, BrokenLooksDoNotKeepACharacterOut) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  for (const char* broken : {"NORMAL", "TEXCOORD_0", "COLOR_0"}) {
    TinyGltf file = SeamedStrip().file();
    file.amend = [broken, whole = file.amend](Json& json, GltfBuffer& buffer) {
      whole(json, buffer);
      buffer.accessors[json["meshes"][0]["primitives"][0]["attributes"][broken].get<std::size_t>()]["count"] = 1000;
    };
    const Read got = read(file, directory.path);
    ASSERT_EQ(got.warnings.size(), 1u) << broken;
    EXPECT_NE(got.warnings[0].find(broken), std::string::npos) << got.warnings[0];
    EXPECT_EQ(got.character.skin.triangles.cols(), 4);
  }
}

TEST(Appearance, AFileOfItComesBackToTheBitAndNothingElseDoes) {
  const TemporaryDirectory directory;
  put(directory.path / "fur.png", png());
  put(directory.path / "light map.png", png());
  const Read got = read(strip_with_all().file(), directory.path);
  const std::string bytes = appearance_bytes(got.appearance);
  Read again = got;
  again.appearance = parse_appearance(bytes, "appearance.bin", 6);
  EXPECT_EQ(appearance_bytes(again.appearance), bytes);
  // What the file does not hold would be lost in what is drawn.
  write(directory.path / "drawn.glb", got);
  write(directory.path / "drawn_again.glb", again);
  EXPECT_EQ(bytes_of(directory.path / "drawn_again.glb"), bytes_of(directory.path / "drawn.glb"));
  EXPECT_THROW(parse_appearance(bytes, "appearance.bin", 5), Error) << "of another skin";
  EXPECT_THROW(parse_appearance(bytes.substr(0, bytes.size() / 2), "appearance.bin", 6), Error);
}

TEST(Appearance, VertexColoursOfFbxComeAlong) {
  Appearance looks;
  const retarget::Character character = import_character(HYDROSTAT_TESTS "/fuzz/corpus/face.fbx", "", {}, nullptr, &looks);
  ASSERT_EQ(looks.parts.size(), 1u);
  ASSERT_EQ(looks.parts[0].colours.cols(), 6);
  for (Eigen::Index d = 0; d < 6; ++d) {
    const bool is_top = character.skin.vertices(1, looks.parts[0].vertices[d]) > 1.5;
    EXPECT_LT((looks.parts[0].colours.col(d) - Eigen::Vector4d(1, is_top ? 0.5 : 1, 0.25, 1)).norm(), 1e-6);
  }
}

TEST(ImageType, IsKnownOfWholeImagesAlone) {
  EXPECT_EQ(image_type(png()), "image/png");
  for (std::size_t length = 0; length < png().size() - 4; ++length) EXPECT_EQ(image_type(png().substr(0, length)), "");
  using namespace std::string_literals;
  const std::string jpeg = "\xff\xd8\xff\xe0\0\4ab\xff\xc0\0\x0b\x08\0\1\0\1\1\1\x11\0\xff\xda\0\2zz\xff\xd9"s;
  EXPECT_EQ(image_type(jpeg), "image/jpeg");
  for (std::size_t length = 0; length < jpeg.size(); ++length) EXPECT_EQ(image_type(jpeg.substr(0, length)), "");
}

/// Clips that nobody made for us.
fs::path asset(const char* name) {
  const char* named = std::getenv("HYDROSTAT_ASSETS");
  return fs::path(named != nullptr ? named : HYDROSTAT_DEFAULT_ASSETS) / name;
}

TEST(ThirdPartyAppearance, AnFbxTellsColoursOfItsPartsAndTheImageWithinIt) {
  if (!fs::exists(asset("fbx/frog.fbx"))) GTEST_SKIP() << "left out: the clips are missing (set HYDROSTAT_ASSETS)";
  Appearance frog, slime, cowboy;
  std::vector<std::string> warnings;
  import_character(asset("fbx/frog.fbx").string(), "", {}, nullptr, &frog);
  import_character(asset("fbx/maya_slime.fbx").string(), "", {}, nullptr, &slime);
  import_character(asset("collada/cowboy.dae").string(), "", {}, &warnings, &cowboy);
  ASSERT_EQ(frog.materials.size(), 4u);
  std::map<std::string, Eigen::Index> triangles;
  for (const Appearance::Part& part : frog.parts)
    triangles[frog.materials[static_cast<std::size_t>(part.material)].name] += part.triangles.cols();
  EXPECT_NEAR(static_cast<double>(triangles["Green"]), 3784, 10);  // a few collapse
  EXPECT_NEAR(static_cast<double>(triangles["Black"]), 96, 2);
  const auto green =
      std::find_if(frog.materials.begin(), frog.materials.end(), [](const Material& m) { return m.name == "Green"; });
  EXPECT_LT((green->base_colour.head<3>() - Eigen::Vector3d(0.216398, 0.397546, 0.117622)).norm(), 1e-5);
  ASSERT_EQ(slime.images.size(), 1u);
  EXPECT_EQ(slime.images[0].bytes.size(), 306577u);
  EXPECT_EQ(slime.materials.at(0).base_colour, Eigen::Vector4d::Ones());
  EXPECT_TRUE(cowboy.images.empty());
  EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                          [](const std::string& text) { return text.find("'character Texture.png'") != std::string::npos; }),
            1);
}

}  // namespace
}  // namespace hydrostat::io::appearance_test
