// SPDX-License-Identifier: Apache-2.0
// What a live session reads back after it was killed: the list of files that were taken out, and of each scan the
// record and what was learnt of its sensor. The first byte says which of them the rest replaces. Each is read, or an
// Error, or taken away and told.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asbuilt/live/scan_store.h"
#include "fuzz/seeds.h"

namespace {

namespace fs = std::filesystem;
using asbuilt::live::ScanStore;

[[noreturn]] void complain(std::string_view what) {
  std::cerr << what << '\n';
  std::abort();
}

void write(const fs::path& path, std::string_view content) { std::ofstream(path, std::ios::binary) << content; }

/// A session of one scan, of which one file at a time is replaced.
class Session {
 public:
  Session() { fs::create_directories(base); }
  ~Session() { fs::remove_all(base); }

  void write_all() const {
    fs::create_directories(scan);
    write(base / "live.json", asbuilt::test::kRemovedSeed);
    write(scan / "live.json", asbuilt::test::kSensorSeed);
    write(scan / "result.json", asbuilt::test::kRecordSeed);
  }

  const fs::path base = fs::temp_directory_path() / ("asbuilt-fuzz-state-" + std::to_string(::getpid()));
  const fs::path scan = base / "scans" / "a.ply";
};

/// What was read can be written, and reads the same again.
void write_and_read_again(ScanStore store, const fs::path& base) {
  const auto removed = store.removed();
  if (!store.set_removed("b.ply", "0")) complain("cannot be written");
  { const ScanStore let_go = std::move(store); }  // the folder is that of one store at a time
  std::vector<std::string> lost;
  const auto again = ScanStore::open(base, lost);
  if (!again || !lost.empty()) complain("what was written cannot be read");
  for (const auto& [file, sha256] : removed) {
    if (file != "b.ply" && again->removed().at(file) != sha256) complain("another list than was written");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view content(reinterpret_cast<const char*>(data) + 1, size - 1);
  static const Session session;
  session.write_all();
  const char which = static_cast<char>(data[0]);
  const fs::path replaced = which == 'r'   ? session.base / "live.json"
                            : which == 's' ? session.scan / "live.json"
                                           : session.scan / "result.json";
  write(replaced, content);
  std::vector<std::string> lost;
  asbuilt::Result<ScanStore> opened = ScanStore::open(session.base, lost);
  if (!opened) {
    if (opened.error().message.find("live.json") == std::string::npos) complain("an error that names no file");
    return 0;
  }
  if (opened->files().size() + lost.size() != 1) complain("the scan was neither read nor told to be lost");
  if (fs::exists(session.scan) != lost.empty()) complain("what is lost must go, what is read must stay");
  if (which == 'r' && lost.empty()) write_and_read_again(std::move(*opened), session.base);
  return 0;
}
