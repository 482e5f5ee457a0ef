// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/prepared_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "asbuilt/io/file.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

using ::testing::HasSubstr;

class PreparedFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("asbuilt_prepared_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "part.prepared";
    ASSERT_TRUE(save_prepared(path_, model_));
    content_ = io::read_file(path_).value();
  }
  static void SetUpTestSuite() {
    const TriangleMesh mesh = test::together(test::sphere({0, 0, 0}, 50.0, 2), test::box({0, 0, 0}, {10, 10, 10}));
    model_ = prepare(mesh, {}, Context(2)).value();
    model_.source_path = "part.stl";
    model_.source_sha256 = std::string(64, 'a');
  }
  static void TearDownTestSuite() { model_ = {}; }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string message_for(const std::string& content) {
    const std::filesystem::path path = folder_ / "other.prepared";
    EXPECT_TRUE(io::write_file(path, content));
    const auto loaded = load_prepared(path, context_);
    if (loaded) return "it was loaded";
    EXPECT_EQ(loaded.error().code, ErrorCode::unreadable_input);
    EXPECT_THAT(loaded.error().message, HasSubstr("other.prepared"));
    return loaded.error().message;
  }

  Context context_{2};
  std::filesystem::path folder_, path_;
  std::string content_;
  inline static PreparedModel model_;
};

TEST_F(PreparedFile, ComesBackAsItWas) {
  const PreparedModel loaded = load_prepared(path_, context_).value();
  EXPECT_EQ(loaded.diameter, model_.diameter);
  EXPECT_EQ(loaded.sampling_distance, model_.sampling_distance);
  EXPECT_EQ(loaded.skin.vertices, model_.skin.vertices);
  EXPECT_EQ(loaded.skin.triangles, model_.skin.triangles);
  EXPECT_EQ(loaded.face_normals, model_.face_normals);
  EXPECT_EQ(loaded.box.min(), model_.box.min());
  EXPECT_EQ(loaded.box.max(), model_.box.max());
  EXPECT_EQ(loaded.samples.positions, model_.samples.positions);
  EXPECT_EQ(loaded.samples.normals, model_.samples.normals);
  EXPECT_EQ(loaded.dense_samples.positions, model_.dense_samples.positions);
  EXPECT_EQ(loaded.dense_samples.normals, model_.dense_samples.normals);
  EXPECT_EQ(loaded.report.triangles_in, model_.report.triangles_in);
  EXPECT_EQ(loaded.report.inner_dropped, 12U);
  EXPECT_EQ(loaded.report.notes, model_.report.notes);
  EXPECT_EQ(loaded.report.thin_wall, model_.report.thin_wall);
  EXPECT_EQ(loaded.source_path, "part.stl");
  EXPECT_EQ(loaded.source_sha256, model_.source_sha256);
  const Eigen::Vector3f probe(30, 30, 31);
  EXPECT_EQ(loaded.field->at(probe).distance, model_.field->at(probe).distance);
  EXPECT_EQ(loaded.surface->nearest({60, 1, 2}).point, model_.surface->nearest({60, 1, 2}).point);
  EXPECT_TRUE(loaded.rays->first_hit({0, 0, 90}, {0, 0, -1}).found());
}

TEST_F(PreparedFile, KeepsTheSymmetry) {
  PreparedModel model = model_;
  const auto turn = [](double angle) { return rotation_about({0, 0.6, 0.8}, {1, 2, 3}, angle); };
  model.symmetry.kind = SymmetryGroup::Kind::discrete;
  model.symmetry.order = 2;
  model.symmetry.axis = {0, 0.6, 0.8};
  model.symmetry.centre = {1, 2, 3};
  model.symmetry.elements = {Pose::Identity(), turn(3.14159265358979)};
  model.symmetry.near = {{turn(0.5), 0.9, {4, 5, 6}}, {turn(1.5), 0.8, {7, 8, 9}}};
  model.symmetry.near_axes = {{{1, 0, 0}, {3, 2, 1}, 0.85}};
  ASSERT_TRUE(save_prepared(folder_ / "symmetric", model));
  const SymmetryGroup loaded = load_prepared(folder_ / "symmetric", context_).value().symmetry;
  EXPECT_EQ(loaded.kind, SymmetryGroup::Kind::discrete);
  EXPECT_EQ(loaded.order, 2);
  EXPECT_EQ(loaded.axis, model.symmetry.axis);
  EXPECT_EQ(loaded.centre, model.symmetry.centre);
  ASSERT_EQ(loaded.elements.size(), 2U);
  EXPECT_EQ(loaded.elements[1].matrix(), model.symmetry.elements[1].matrix());
  ASSERT_EQ(loaded.near.size(), 2U);
  EXPECT_EQ(loaded.near[1].motion.matrix(), model.symmetry.near[1].motion.matrix());
  EXPECT_EQ(loaded.near[1].share, 0.8);
  EXPECT_EQ(loaded.near[1].breaks_at, Eigen::Vector3d(7, 8, 9));
  ASSERT_EQ(loaded.near_axes.size(), 1U);
  EXPECT_EQ(loaded.near_axes[0].axis, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(loaded.near_axes[0].point, Eigen::Vector3d(3, 2, 1));
  EXPECT_EQ(loaded.near_axes[0].share, 0.85);
  model.symmetry.elements[1].linear() *= 2.0;
  ASSERT_TRUE(save_prepared(folder_ / "stretched", model));
  EXPECT_FALSE(load_prepared(folder_ / "stretched", context_));
}

TEST_F(PreparedFile, HasTheSameBytesWhenItIsSavedAgain) {
  ASSERT_TRUE(save_prepared(folder_ / "again", load_prepared(path_, context_).value()));
  EXPECT_EQ(io::read_file(folder_ / "again").value(), content_);
}

TEST_F(PreparedFile, IsToldFromOtherFiles) {
  EXPECT_TRUE(is_prepared_file(path_));
  EXPECT_FALSE(is_prepared_file(folder_ / "missing"));
  EXPECT_FALSE(is_prepared_file(folder_));
  ASSERT_TRUE(io::write_file(folder_ / "part.stl", "solid part\nendsolid part\n"));
  EXPECT_FALSE(is_prepared_file(folder_ / "part.stl"));
  EXPECT_THAT(message_for("solid part\nendsolid part\n"), HasSubstr("not a prepared model"));
  EXPECT_THAT(message_for(""), HasSubstr("not a prepared model"));
}

TEST_F(PreparedFile, IsRefusedWhereverItIsCutOff) {
  for (std::size_t share = 1; share < 40; ++share) {
    const std::string message = message_for(content_.substr(0, content_.size() * share / 40));
    EXPECT_THAT(message, HasSubstr("prepare it again")) << share;
  }
  for (const std::size_t size :
       {std::size_t{16}, std::size_t{20}, std::size_t{27}, std::size_t{28}, content_.size() - 1}) {
    EXPECT_THAT(message_for(content_.substr(0, size)), HasSubstr("prepare it again")) << size;
  }
  EXPECT_THAT(message_for(content_ + "x"), HasSubstr("prepare it again"));
}

TEST_F(PreparedFile, IsRefusedWhenAnyByteOfItIsDamaged) {
  Random random(1, "damage", 0);
  for (int i = 0; i < 60; ++i) {
    std::string damaged = content_;
    const std::size_t place = random.below(damaged.size());
    damaged[place] = static_cast<char>(damaged[place] ^ (1 << random.below(8)));
    EXPECT_NE(message_for(damaged), "it was loaded") << "byte " << place;
  }
}

TEST_F(PreparedFile, KeepsTheNamesOfCadFaces) {
  PreparedModel named = model_;
  named.face_names = {{"bore A", ""}, {}, {"Dichtfläche <b>\"", "lid"}};
  ASSERT_TRUE(save_prepared(path_, named));
  EXPECT_EQ(load_prepared(path_, context_).value().face_names, named.face_names);
}

TEST_F(PreparedFile, OfTheVersionWithoutNamesIsStillRead) {
  // Its body ended before the names, of which there are none here: eight bytes that count them.
  constexpr std::size_t kHeader = 28, kDigest = 64, kCount = 8;
  const std::string body = content_.substr(kHeader, content_.size() - kHeader - kDigest - kCount);
  std::string header = content_.substr(0, kHeader);
  header[16] = 3;
  for (std::size_t i = 0; i < 8; ++i) header[20 + i] = static_cast<char>((body.size() >> (8 * i)) & 0xFF);
  ASSERT_TRUE(io::write_file(path_, header + body + io::sha256(body)));
  const auto loaded = load_prepared(path_, context_);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->skin.vertices, model_.skin.vertices);
  EXPECT_TRUE(loaded->face_names.empty());
}

TEST_F(PreparedFile, OfANewerVersionSaysSo) {
  std::string newer = content_;
  newer[16] = 5;
  const std::string message = message_for(newer);
  EXPECT_THAT(message, HasSubstr("version 5"));
  EXPECT_THAT(message, HasSubstr("newer"));
}

TEST_F(PreparedFile, WithAValidChecksumOverNonsenseIsRefused) {
  // What a bug in a writer would make: the skin's vertex count, right after the two sizes, asks for the moon.
  std::string wrong = content_;
  const std::size_t header = 28, count = header + 16;
  wrong[count + 7] = 0x7f;
  const std::string body = wrong.substr(header, wrong.size() - header - 64);
  EXPECT_THAT(message_for(wrong.substr(0, header) + body + io::sha256(body)), HasSubstr("contradicts itself"));
}

TEST_F(PreparedFile, ThatCannotBeWrittenIsAnError) {
  const auto saved = save_prepared(folder_ / "no" / "such" / "folder" / "part", model_);
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, ErrorCode::unwritable_output);
}

}  // namespace
}  // namespace asbuilt::model
