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
#include <optional>
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

void write(const fs::path& path, std::string_view content) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << content;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view content(reinterpret_cast<const char*>(data) + 1, size - 1);
  static const fs::path base = fs::temp_directory_path() / ("asbuilt-fuzz-state-" + std::to_string(::getpid()));
  const fs::path scan = base / "scans" / "a.ply";
  fs::remove_all(base);
  write(base / "live.json", data[0] == 'r' ? content : asbuilt::test::kRemovedSeed);
  write(scan / "live.json", data[0] == 's' ? content : asbuilt::test::kSensorSeed);
  write(scan / "result.json", data[0] == 'd' ? content : asbuilt::test::kRecordSeed);
  std::vector<std::string> lost;
  asbuilt::Result<ScanStore> opened = ScanStore::open(base, lost);
  if (!opened) {
    if (opened.error().message.find("live.json") == std::string::npos) complain("an error that names no file");
    return 0;
  }
  std::optional<ScanStore> store(std::move(*opened));
  if (store->files().size() + lost.size() != 1) complain("the scan was neither read nor told to be lost");
  if (fs::exists(scan) != lost.empty()) complain("what is lost must go, what is read must stay");
  // What was read can be written, and reads the same again.
  const auto removed = store->removed();
  if (!store->set_removed("b.ply", "0")) complain("cannot be written");
  store.reset();  // the folder is that of one store at a time
  lost.clear();
  const auto again = ScanStore::open(base, lost);
  if (!again || !lost.empty()) complain("what was written cannot be read");
  for (const auto& [file, sha256] : removed) {
    if (file != "b.ply" && again->removed().at(file) != sha256) complain("another list than was written");
  }
  return 0;
}
