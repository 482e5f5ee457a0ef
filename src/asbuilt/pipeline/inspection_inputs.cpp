// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/inspection_inputs.h"

#include <fmt/format.h>

#include <charconv>

#include "asbuilt/io/file.h"

namespace asbuilt::pipeline {
namespace {

Result<report::InputFile> hashed(const std::string& path) {
  ASBUILT_TRY(content, io::read_file(path));
  return report::InputFile{path, io::sha256(content)};
}

Result<std::vector<int>> face_numbers(std::string_view text) {
  std::vector<int> faces;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), word.size() + 1));
    int face = -1;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), face);
    if (error != std::errc() || end != word.data() + word.size() || face < 0) {
      return fail(ErrorCode::invalid_argument,
                  fmt::format("--align-on faces:{}: found '{}', expected the number of a CAD face", text, word));
    }
    faces.push_back(face);
  }
  if (!faces.empty()) return faces;
  return fail(ErrorCode::invalid_argument, "--align-on faces: names no face, expected for example faces:3,4,7");
}

Result<inspect::AlignmentOptions> alignment_of(const Options& options) {
  inspect::AlignmentOptions alignment;
  if (options.alignment == Alignment::as_refined) {
    if (options.align_on == "all") return alignment;
    return fail(ErrorCode::invalid_argument, "--align-on says where to fit; give --alignment best-fit with it");
  }
  alignment.method = inspect::AlignmentMethod::best_fit;
  if (options.align_on == "all") return alignment;
  constexpr std::string_view kFaces = "faces:";
  if (options.align_on.starts_with(kFaces)) {
    ASBUILT_TRY(faces, face_numbers(std::string_view(options.align_on).substr(kFaces.size())));
    alignment.faces = std::move(faces);
    return alignment;
  }
  ASBUILT_TRY(places, inspect::read_reference_points(options.align_on));
  for (const inspect::ReferencePoint& place : places) alignment.places.push_back(place.position);
  return alignment;
}

}  // namespace

Result<InspectionInputs> inspection_inputs(const Options& options) {
  InspectionInputs inputs;
  inputs.options = options.inspect;
  if (!options.tolerance_file.empty()) {
    ASBUILT_TRY(table, inspect::read_tolerances(options.tolerance_file));
    inputs.options.tolerances = std::move(table);
    ASBUILT_TRY(file, hashed(options.tolerance_file));
    inputs.tolerance_file = std::move(file);
  }
  if (!options.reference.empty()) {
    ASBUILT_TRY(points, inspect::read_reference_points(options.reference));
    inputs.options.reference = std::move(points);
    ASBUILT_TRY(file, hashed(options.reference));
    inputs.reference_file = std::move(file);
  }
  ASBUILT_TRY(alignment, alignment_of(options));
  inputs.options.alignment = std::move(alignment);
  return inputs;
}

}  // namespace asbuilt::pipeline
