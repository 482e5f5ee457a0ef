// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>

#include "asbuilt/live/session.h"
#include "commands.h"
#include "options.h"
#include "watch_loop.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, watch, output;
  viewer::ServerOptions server;
  pipeline::Options options;
  std::vector<double> sensor;
  double idle_seconds = 1.5;
  bool no_result = false;
};

Result<live::LiveOptions> live_options(const Arguments& arguments) {
  live::LiveOptions options;
  options.pipeline = arguments.options;
  if (arguments.sensor.empty()) return options;
  const double half_angle = arguments.sensor[0], near = arguments.sensor[1], far = arguments.sensor[2];
  if (!(half_angle > 0.0 && half_angle <= 180.0 && near >= 0.0 && far > near)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--sensor {},{},{}: expected half of the opening angle in degrees, (0, 180], and the "
                            "nearest and farthest distance in mm, 0 <= nearest < farthest",
                            half_angle, near, far));
  }
  options.sensor = live::SensorLimits{half_angle, near, far, 0.5 * (near + far), "given"};
  return options;
}

/// What a person at the console wants to read: each scan and each note once, and the line that says what to do.
class Console {
 public:
  explicit Console(Shell& shell) : shell_(shell) {}

  void tell(const live::LiveState& state) {
    shell_.print_json(live::to_json(state) + "\n");
    for (const live::ScanState& scan : state.scans) {
      const std::string key = scan.file + "/" + scan.record.name;
      if (scan.provisional || told_[key] == scan.record.sha256) continue;
      if (scan.record.sha256.empty() && told_.contains(key) && told_[key] == "-") continue;
      told_[key] = scan.record.sha256.empty() ? "-" : scan.record.sha256;
      shell_.print_result(scan.sentence + "\n");
    }
    for (const live::Note& note : state.notes) {
      if (note.revision <= last_note_) continue;
      last_note_ = note.revision;
      if (note.level == "info") {
        shell_.print_result(note.text + "\n");
      } else {
        shell_.warn(note.text);
      }
    }
    if (state.now_text != now_ && state.phase != "judging") {
      now_ = state.now_text;
      shell_.print_result("> " + now_ + "\n");
    }
    std::fflush(stdout);
  }

 private:
  Shell& shell_;
  std::map<std::string, std::string> told_;
  std::uint64_t last_note_ = 0;
  std::string now_;
};

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_TRY(options, live_options(arguments));
  const Context context = shell.context();
  std::error_code error;
  if (!std::filesystem::is_directory(arguments.watch, error)) {
    return fail(
        ErrorCode::unreadable_input,
        fmt::format("{}: there is no such folder; --watch names the one in which scans arrive", arguments.watch));
  }
  const std::string output =
      arguments.output.empty() ? (std::filesystem::path(arguments.watch) / "asbuilt-live").string() : arguments.output;
  // Ctrl-C ends the session, not the scan that is being judged: it is part of the result.
  Context steady = context;
  steady.progress = nullptr;
  steady.stop = {};
  ASBUILT_TRY(session, live::LiveSession::open(arguments.model, options, output, shell.common.force, steady));
  viewer::WatchOptions watch;
  watch.watch = arguments.watch;
  watch.server = arguments.server;
  watch.idle =
      std::chrono::milliseconds(static_cast<std::int64_t>(1000.0 * std::clamp(arguments.idle_seconds, 0.0, 3600.0)));
  Console console(shell);
  viewer::WatchReports reports;
  reports.started = [&](const viewer::Server& server) {
    shell.print_result(fmt::format("Watching {}; the page is at {}\nCtrl-C ends the session and writes {}/result.\n",
                                   arguments.watch, server.address(), output));
    if (shell.common.json) fmt::print(stderr, "asbuilt live: {}\n", server.address());
    std::fflush(stdout);
  };
  reports.state = [&](const live::LiveState& state) { console.tell(state); };
  ASBUILT_CHECK(viewer::run_watch(*session, watch, reports, context.stop));

  if (arguments.no_result || session->state()->scans.empty()) return kDone;
  auto record = session->write_result({});
  if (!record) {
    return fail(record.error().code,
                fmt::format("{}; the session is whole: start it again with the same command, or write the result "
                            "elsewhere with asbuilt register {}/scans/* -o DIR",
                            record.error().message, output));
  }
  shell.print_result(summary_of(*record, (std::filesystem::path(output) / "result").string()));
  return exit_code_of(*record);
}

}  // namespace

void add_live_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("live", "Live feedback while scanning, in the browser");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MODEL", arguments->model, "CAD model or prepared model")->required();
  command->add_option("--watch", arguments->watch, "Folder in which scans arrive")->required();
  command->add_option("-o,--output", arguments->output, "Folder of the session (default: WATCH/asbuilt-live)");
  command->add_option("--port", arguments->server.port, "Port of the page; 0 takes any that is free")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  command->add_option("--host", arguments->server.host, "Address to bind; other than loopback, a token is needed")
      ->capture_default_str();
  command->add_option("--token", arguments->server.token, "Token to ask for (default: random if not on loopback)");
  command->add_option("--sensor", arguments->sensor, "ANGLE,NEAR,FAR: half of the field's angle, range in mm")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--idle", arguments->idle_seconds, "Seconds without a scan before all are refined jointly")
      ->capture_default_str();
  command->add_flag("--no-result", arguments->no_result, "End without writing the result; register does it later");
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options,
                       {pipeline::Half::model, pipeline::Half::scan, pipeline::Half::joint});
  command->footer(
      "Examples:\n"
      "  asbuilt live part.stl --watch scans -o session\n"
      "  asbuilt live part.stl --watch scans -o session --host 0.0.0.0 --port 8600");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
