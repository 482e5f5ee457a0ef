// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/parallel.h"
#include "asbuilt/live/session_implementation.h"
#include "asbuilt/pipeline/collect_runs.h"
#include "asbuilt/pipeline/inspection_inputs.h"

namespace asbuilt::live {

Result<io::RunRecord> LiveSession::write_result(std::stop_token stop) {
  Implementation& own = *implementation_;
  const std::filesystem::path place = own.folder / "result";
  Context stoppable = own.context;
  stoppable.stop = stop;
  const auto write = [&]() -> Result<io::RunRecord> {
    std::vector<std::string> runs;
    for (const auto& [file, stored] : own.store->files()) runs.push_back(stored.folder.string());
    if (runs.empty()) return fail(ErrorCode::not_possible, "there is no scan yet, so there is no result to write");
    ASBUILT_TRY(folder, pipeline::RunFolder::open(place, "register", false, own.context.arena().threads()));
    pipeline::Options nobody_named = own.options.pipeline;  // --exclude and --accept were carried out scan by scan
    nobody_named.exclude.clear();
    nobody_named.accept.clear();
    ASBUILT_TRY(record, pipeline::collect_runs(runs, nobody_named, folder));
    const pipeline::ScanHalf half = own.shared.half(own.model, own.options.pipeline);
    pipeline::look_for_mistaken_unit(record, half, folder, stoppable);
    record.options =
        pipeline::merged(std::move(record.options), pipeline::recorded(own.options.pipeline, {pipeline::Half::joint}));
    ASBUILT_TRY(inspection, pipeline::inspection_inputs(own.options.pipeline));
    ASBUILT_CHECK(pipeline::register_scans(own.model, own.options.pipeline, inspection, folder, record, stoppable));
    ASBUILT_CHECK(folder.finish(record));
    return std::move(record);
  };
  own.publish_light(on_change, [](LiveState& state) {
    state.phase = "writing";
    state.result = "running";
    state.result_text.clear();
  });
  auto record = write();
  own.publish_light(on_change, [&](LiveState& state) {
    state.phase = "waiting";
    state.result = record ? "done" : "failed";
    state.result_folder = record ? place.string() : std::string();
    state.result_text = record ? std::string() : record.error().message;
  });
  return record;
}

}  // namespace asbuilt::live
