// SPDX-License-Identifier: Apache-2.0
// One libFuzzer target per family of readers; ASBUILT_FUZZ_FAMILY picks it.
#include <cstdint>
#include <string>
#include <string_view>

#include "asbuilt/io/crc32c.h"
#include "asbuilt/io/step_text.h"
#include "fuzz/soundness.h"
#include "unit/io/png_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using asbuilt::test::require_sound;
  namespace io = asbuilt::io;
  constexpr std::string_view kFamily = ASBUILT_FUZZ_FAMILY;
  const io::Input input{"input", std::string_view(reinterpret_cast<const char*>(data), size)};
  if (kFamily == "ply") {
    require_sound(io::read_ply_scan("input.ply", input, io::Unit::metre));
    require_sound(io::mesh_from("input.ply", input, io::Unit::inch));
  } else if (kFamily == "pcd") {
    require_sound(io::read_pcd_scan("input.pcd", input, io::Unit::metre));
  } else if (kFamily == "text") {
    require_sound(io::read_text_scan("input.xyz", input, io::Unit::metre));
  } else if (kFamily == "mesh") {
    for (const char* name : {"input.stl", "input.off", "input.obj"}) {
      require_sound(io::mesh_from(name, input, io::Unit::metre));
      require_sound(io::scans_from(name, input, io::Unit::metre));
    }
  } else if (kFamily == "e57") {
    // Whole pages with right checksums: what the fuzzer changes gets past them.
    std::string file(input.content);
    file.resize((file.size() + 1023) / 1024 * 1024, '\0');
    for (std::size_t at = 0; at < file.size(); at += 1024) {
      const std::uint32_t crc = io::crc32c(std::string_view(file).substr(at, 1020));
      for (unsigned i = 0; i < 4; ++i) file[at + 1020 + i] = static_cast<char>(crc >> (24 - 8 * i));
    }
    require_sound(io::read_e57_scans("input.e57", {"input", file}, io::Unit::stated));
  } else if (kFamily == "ptx") {
    require_sound(io::read_ptx_scans("input.ptx", input, io::Unit::stated));
  } else if (kFamily == "las") {
    require_sound(io::read_las_scan("input.las", input, io::Unit::stated));
  } else if (kFamily == "depth") {
    std::string image(input.content);
    asbuilt::test::repair_png_checksums(image);
    require_sound(io::read_depth_scan("input.png", {"input", image}, asbuilt::test::reading(io::Unit::stated)));
  } else if (kFamily == "gzip") {
    require_sound(io::scans_in("input.xyz.gz", input.content, io::Unit::stated));
  } else if (kFamily == "step") {  // names in STEP files; what OpenCASCADE reads is its own affair
    if (io::decoded_step_text(input.content).size() > input.content.size()) __builtin_trap();
  } else {
    require_sound(io::poses_from(input, io::Unit::metre));
    require_sound(io::viewpoints_from(input, io::Unit::metre));
  }
  return 0;
}
