// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/judge_scan.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"

namespace asbuilt::pipeline {

/// The half of the method that looks at one scan at a time (Sec. 3.1): read, prepare, vote, verify, cut out.
///
/// Writes segments/NNN_NAME.ply and a checkpoint after every scan; what an earlier run of the same command finished is
/// kept if file, model, options and version are the same. At most one scan is in memory. A scan that cannot be read or
/// worked on gets the status `failed`, a warning, and stops nobody else.
///
/// The record's state stays partial: whoever asked decides what completes it.
/// Errors: invalid_argument (options that name no scan), unreadable_input (the files of --poses and --viewpoint),
/// unwritable_output, cancelled.
[[nodiscard]] Result<io::RunRecord> detect_scans(const LoadedModel& model, std::span<const std::string> scan_paths,
                                                 const Options& options, RunFolder& folder, const Context& context);

// For callers that get their scans one by one (live/).

/// A scan file that was read and hashed; why not, if it could not be.
struct InputFile {
  std::string path, sha256;
  Result<std::vector<io::ScanFile>> scans;
};
[[nodiscard]] InputFile read_input(const std::string& path, const Options& options, const Context& context);

/// What all scans of a run share, made once.
struct SharedByScans {
  std::shared_ptr<const detect::Codebook> codebook;
  Viewpoints viewpoints;
  std::vector<io::NamedPose> starts;
  io::RunRecord empty_record;  ///< version, options and model of every record of the scan half

  /// Refers to this object, model and options, which must outlive it.
  [[nodiscard]] ScanHalf half(const LoadedModel& model, const Options& options) const;
};
[[nodiscard]] Result<SharedByScans> shared_by_scans(const LoadedModel& model, const Options& options, RunFolder& folder,
                                                    const Context& context);

/// Judges all scans of a file, appends their entries to the record, writes their segments and a checkpoint; the cloud
/// of each is gone afterwards. Errors: unwritable_output, cancelled.
[[nodiscard]] Result<void> take_scans(InputFile& input, const ScanHalf& half, RunFolder& folder, io::RunRecord& record,
                                      const Context& context);

/// When nothing was found anywhere, a mistaken unit is the likeliest cause: says so if it is. Where the part was found
/// in other scans, only one whose points lie far closer or far wider than theirs is suspected. For a whole record.
void look_for_mistaken_unit(io::RunRecord& record, const ScanHalf& half, RunFolder& folder, const Context& context);

}  // namespace asbuilt::pipeline
