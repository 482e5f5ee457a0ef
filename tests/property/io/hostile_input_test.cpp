// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "asbuilt/core/random.h"
#include "fuzz/seeds.h"
#include "fuzz/soundness.h"

namespace asbuilt::test {
namespace {

std::size_t points_of(const std::vector<io::ScanFile>& scans) {
  std::size_t points = 0;
  for (const io::ScanFile& scan : scans) points += scan.cloud.size();
  return points;
}

bool is_pose_file(const Seed& seed) { return seed.family == "pose"; }

TEST(HostileInput, EverySeedIsValid) {
  for (const Seed& seed : seeds()) {
    const io::Input input{seed.name, seed.content};
    if (seed.name == "viewpoints.csv") {
      EXPECT_TRUE(io::viewpoints_from(input, io::Unit::stated));
    } else if (is_pose_file(seed)) {
      EXPECT_TRUE(io::poses_from(input, io::Unit::stated)) << seed.name;
    } else {
      const auto scans = io::scans_in(seed.name, seed.content, reading(io::Unit::stated));
      ASSERT_TRUE(scans) << scans.error().message;
      EXPECT_EQ(points_of(*scans), seed.points) << seed.name;
      for (const std::string& note : scans->front().notes) {
        EXPECT_THAT(note, ::testing::Not(::testing::HasSubstr("cut off"))) << seed.name;
      }
      EXPECT_EQ(io::mesh_from(seed.name, input, io::Unit::stated).has_value(), seed.is_mesh) << seed.name;
    }
  }
}

/// Whether a reader told that something is missing.
bool tells_of_the_cut(const std::vector<io::ScanFile>& scans, const std::vector<io::ScanFile>& whole) {
  return scans.back().notes != whole.back().notes;
}

TEST(HostileInput, ASeedCutAtAnyByteIsAnErrorOrAReportedPartialRead) {
  for (const Seed& seed : seeds()) {
    if (is_pose_file(seed)) continue;
    const auto whole = io::scans_in(seed.name, seed.content, reading(io::Unit::stated));
    for (std::size_t length = 0; length < seed.content.size(); ++length) {
      const std::string cut = seed.content.substr(0, length);
      SCOPED_TRACE(seed.name + " cut after " + std::to_string(length) + " of " + std::to_string(seed.content.size()));
      ASSERT_NO_THROW(read_in_every_way(seed.name, cut));
      const auto scans = io::scans_in(seed.name, cut, reading(io::Unit::stated));
      if (!scans) continue;
      // A text that declares no count and ends with a line is whole as far as anyone can tell.
      if (!seed.declares_count && cut.ends_with('\n')) continue;
      // In STL a keyword ends the file, so that only blanks can be missing.
      if (seed.name.ends_with(".stl")) {
        EXPECT_EQ(points_of(*scans), seed.points);
        continue;
      }
      EXPECT_TRUE(tells_of_the_cut(*scans, *whole));
    }
  }
}

TEST(HostileInput, AMeshThatDeclaresItsCountsIsNeverShortened) {
  for (const Seed& seed : seeds()) {
    if (!seed.is_mesh || !seed.declares_count) continue;
    const TriangleMesh whole = io::mesh_from(seed.name, {seed.name, seed.content}, io::Unit::stated).value();
    for (std::size_t length = 0; length < seed.content.size(); ++length) {
      const auto mesh = io::mesh_from(seed.name, {seed.name, seed.content.substr(0, length)}, io::Unit::stated);
      if (!mesh) continue;
      EXPECT_EQ(mesh->triangles, whole.triangles) << seed.name << " cut after " << length;
      EXPECT_EQ(mesh->vertices, whole.vertices) << seed.name << " cut after " << length;
    }
  }
}

TEST(HostileInput, AFileCutWithinItsPointsSaysHowManyOfHowManyThereAre) {
  for (const Seed& seed : seeds()) {
    if (seed.name != "binary.pcd" && seed.name != "little.ply" && seed.name != "big.ply") continue;
    // Both kinds end their vertices at a known byte: the file is cut one byte before.
    const std::size_t end = seed.family == "pcd" ? seed.content.size() : seed.content.size() - 2 * 2 - 7 * 4;
    const auto scans = io::scans_in(seed.name, seed.content.substr(0, end - 1), reading(io::Unit::stated));
    ASSERT_FALSE(scans) << seed.name;
    EXPECT_THAT(scans.error().message, ::testing::HasSubstr("the file ends after 3 of 4")) << seed.name;
  }
}

/// One to four changes of the kinds that break readers: bits, bytes, pieces lost, doubled or moved, large numbers.
std::string mutated(std::string content, Random& random) {
  static const std::vector<std::string> kNasty{"-1",
                                               "0",
                                               "99999999999999999999",
                                               "4294967295",
                                               "2147483648",
                                               "nan",
                                               "1e999",
                                               "\n",
                                               "\xff\xff\xff\xff",
                                               std::string(4, '\0'),
                                               " ",
                                               "#",
                                               ";",
                                               ",",
                                               "\r"};
  for (std::size_t changes = 1 + random.below(4); changes > 0 && !content.empty(); --changes) {
    const std::size_t at = random.below(content.size());
    const std::size_t length = std::min(content.size() - at, 1 + random.below(16));
    const std::string piece = content.substr(at, length);
    switch (random.below(6)) {
      case 0:
        content[at] = static_cast<char>(static_cast<unsigned char>(content[at]) ^ (1u << random.below(8)));
        break;
      case 1:
        content[at] = static_cast<char>(random.below(256));
        break;
      case 2:
        content.erase(at, length);
        break;
      case 3:
        content.insert(random.below(content.size()), piece);
        break;
      case 4:
        content.replace(at, length, kNasty[random.below(kNasty.size())]);
        break;
      default:
        content.resize(at);
    }
  }
  return content;
}

TEST(HostileInput, MutatedFilesGiveAnErrorOrSoundValues) {
  constexpr std::size_t kMutationsPerFormat = 2000;
  for (const Seed& seed : seeds()) {
    for (std::size_t i = 0; i < kMutationsPerFormat; ++i) {
      Random random(1, seed.name, i);
      const std::string content = mutated(seed.content, random);
      ASSERT_NO_THROW(read_in_every_way(seed.name, content)) << seed.name << ", mutation " << i;
    }
  }
}

TEST(HostileInput, MutatedE57FilesWhoseChecksumsAreRepairedGiveAnErrorOrSoundValues) {
  const std::string seed = e57_seed();
  for (std::size_t i = 0; i < 4000; ++i) {
    Random random(1, "e57 with checksums", i);
    std::string content = mutated(seed, random);
    content.resize((content.size() + 1023) / 1024 * 1024, '\0');
    repair_checksums(content);
    ASSERT_NO_THROW(require_sound(io::scans_in("two.e57", content, io::Unit::stated))) << "mutation " << i;
  }
}

TEST(HostileInput, WhatOnceFailedNoLongerDoes) {
  for (const auto& entry : std::filesystem::directory_iterator(ASBUILT_FOUND_INPUTS)) {
    std::ifstream stream(entry.path(), std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(stream), {}};
    for (const char* extension : {".ply", ".pcd", ".xyz", ".stl", ".off", ".obj", ".e57", ".ptx", ".las", ".png"}) {
      ASSERT_NO_THROW(read_in_every_way(std::string("found") + extension, content)) << entry.path();
    }
    const io::Input input{"found", content};
    ASSERT_NO_THROW(require_sound(io::read_ply_scan("found", input, io::Unit::metre))) << entry.path();
    ASSERT_NO_THROW(require_sound(io::read_pcd_scan("found", input, io::Unit::metre))) << entry.path();
    ASSERT_NO_THROW(require_sound(io::read_text_scan("found", input, io::Unit::metre))) << entry.path();
  }
}

}  // namespace
}  // namespace asbuilt::test
