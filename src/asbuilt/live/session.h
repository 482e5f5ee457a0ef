// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/live/next_view.h"
#include "asbuilt/live/state.h"
#include "asbuilt/pipeline/options.h"

namespace asbuilt::live {

struct LiveOptions {
  pipeline::Options pipeline;
  std::optional<SensorLimits> sensor;  ///< of the proposals; learnt from the scans if not given
};

/// A session of scanning, for a program that acquires scans: give it each file as it comes, show its state.
///
/// What is accepted is exactly what `asbuilt detect` says of each file alone, and lies under `folder` before a call
/// returns: a session that was killed goes on when it is opened again. Poses, links, coverage and proposals of the
/// state are updated with every scan (the new scan against those it overlaps) and by refine_jointly(), which computes
/// what the result will have. The result comes from the stored detections alone, in the order of file names.
///
/// One thread at a time may call what changes the session; state(), values() and surface() may be asked from any.
class LiveSession {
 public:
  /// Errors: unreadable_input (the model, live.json), invalid_argument (options), unwritable_output (also: the folder
  /// is not an earlier session, or one with another model or other options, without `force`).
  [[nodiscard]] static Result<std::unique_ptr<LiveSession>> open(const std::string& model_path,
                                                                 const LiveOptions& options,
                                                                 const std::filesystem::path& folder, bool force,
                                                                 const Context& context);
  ~LiveSession();

  /// Judges a file and takes its scans in, in place of those of an earlier file of that name. Nothing happens if the
  /// content is the one known. Content that another file of the session has, too, counts once, under the first name.
  /// A file that is no scan is an entry that failed, not an error here.
  /// Errors: unwritable_output (nothing has changed; try again), cancelled.
  [[nodiscard]] Result<void> add(const std::string& path);

  /// The file is gone: so are its scans. Errors: unwritable_output.
  [[nodiscard]] Result<void> remove(const std::string& file);

  /// Leaves a file out though it is there, until it is restored or its content changes. False if there is none.
  [[nodiscard]] Result<bool> take_out(const std::string& file);
  /// Lets it in again; the caller then adds it. False if it was not out.
  [[nodiscard]] Result<bool> restore(const std::string& file);

  /// Files of the session that are no longer in `present` are removed. For a start after an interruption.
  [[nodiscard]] Result<void> keep_only(const std::vector<std::string>& present);

  /// Graph and poses of all scans as the result will have them, if anything has changed since the last time. False when
  /// stopped, which leaves the state as it was, or when there was nothing to do. Errors: unreadable_input (a segment).
  [[nodiscard]] Result<bool> refine_jointly(std::stop_token stop);
  [[nodiscard]] bool refinement_is_due() const;

  /// Writes folder/result: the same bytes as `asbuilt reconstruct` on the files of the session, sorted by name.
  /// Errors: not_possible (no scan yet), unwritable_output, cancelled.
  [[nodiscard]] Result<io::RunRecord> write_result(std::stop_token stop);

  [[nodiscard]] std::shared_ptr<const LiveState> state() const;
  [[nodiscard]] std::shared_ptr<const SurfaceValues> values() const;
  [[nodiscard]] const Surface& surface() const;

  /// Something to tell that no scan tells.
  void note(const std::string& level, const std::string& file, const std::string& text);
  /// Something keeps the session from its work: the big line says so, until it is over. `what` tells one trouble from
  /// another.
  void set_trouble(const std::string& what, const Trouble& trouble);
  void end_trouble(const std::string& what);
  void set_phase(const std::string& phase, const std::string& busy_with = {});
  void set_watch(const std::string& folder);

  /// Called after every change of the state, by the thread that changed it.
  std::function<void(const std::shared_ptr<const LiveState>&)> on_change;

 private:
  struct Implementation;
  explicit LiveSession(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt::live
