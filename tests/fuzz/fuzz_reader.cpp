// SPDX-License-Identifier: Apache-2.0
// One libFuzzer target per family of readers; ASBUILT_FUZZ_FAMILY picks it.
#include <cstdint>
#include <string>
#include <string_view>

#include "fuzz/soundness.h"

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
  } else {
    require_sound(io::poses_from(input, io::Unit::metre));
    require_sound(io::viewpoints_from(input, io::Unit::metre));
  }
  return 0;
}
