// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/scan_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

#include "asbuilt/io/file.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

tl::unexpected<Error> unwritable(const fs::path& path, const std::error_code& error) {
  return fail(ErrorCode::unwritable_output, fmt::format("{}: {}", path.string(), error.message()));
}

// A rename lasts through a power failure once the folder that holds the name is on disk.
void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

// Two programs in one folder would take each other's scans for leftovers. The system lets go of it when one is killed.
Result<std::shared_ptr<const int>> locked(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return unwritable(folder, {errno, std::generic_category()});
  std::shared_ptr<const int> lock(new int(descriptor), [](const int* held) {
    ::close(*held);
    delete held;
  });
  // Some network shares know no locks: better unguarded than not at all.
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return lock;
  return fail(ErrorCode::unwritable_output,
              fmt::format("{}: another asbuilt live works in this folder; end it, or choose another --output",
                          folder.string()));
}

std::string sidecar(const std::optional<SensorLimits>& limits, std::uint64_t order) {
  Json json{{"order", order}};
  if (limits) {
    json["sensor"] = {{"half_angle", limits->half_angle_deg},
                      {"near", limits->near_mm},
                      {"far", limits->far_mm},
                      {"distance", limits->distance_mm}};
  }
  return json.dump() + "\n";
}

// None, where anything about it is no number: it is learnt anew from the next scans.
std::optional<SensorLimits> limits_of(const Json& json) {
  std::array<double, 4> values{};
  constexpr std::array<const char*, 4> kNames{"half_angle", "near", "far", "distance"};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto found = json.find(kNames[i]);
    if (found == json.end() || !found->is_number()) return std::nullopt;
    values[i] = found->get<double>();
  }
  return SensorLimits{values[0], values[1], values[2], values[3], "learnt"};
}

Result<StoredFile> read_stored(const fs::path& folder) {
  StoredFile stored;
  stored.file = folder.filename().string();
  stored.folder = folder;
  ASBUILT_TRY(record, io::read_run_record(folder / "result.json"));
  stored.record = std::move(record);
  if (stored.record.state == io::RunState::partial) {
    return fail(ErrorCode::unreadable_input, folder.string() + ": is not finished");
  }
  for (std::size_t i = 0; i < stored.record.scans.size(); ++i) {
    const io::ScanRecord& scan = stored.record.scans[i];
    if (!scan.has_segment() || fs::exists(folder / io::segment_file(i, scan.name))) continue;
    return fail(ErrorCode::unreadable_input, folder.string() + ": has lost a segment");
  }
  ASBUILT_TRY(text, io::read_file(folder / "live.json"));
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("order") || !json["order"].is_number_unsigned()) {
    return fail(ErrorCode::unreadable_input, (folder / "live.json").string() + ": is damaged");
  }
  stored.order = json["order"].get<std::uint64_t>();
  if (const auto sensor = json.find("sensor"); sensor != json.end() && sensor->is_object()) {
    stored.limits = limits_of(*sensor);
  }
  return stored;
}

}  // namespace

Result<ScanStore> ScanStore::open(const fs::path& folder, std::vector<std::string>& lost) {
  ScanStore store;
  store.folder_ = folder;
  std::error_code error;
  fs::create_directories(folder / "scans", error);
  if (error) return unwritable(folder / "scans", error);
  ASBUILT_TRY(lock, locked(folder));
  store.lock_ = std::move(lock);
  fs::remove_all(folder / "unfinished", error);  // what was being judged is judged again
  fs::remove_all(folder / "replaced", error);
  std::vector<fs::path> present;
  for (fs::directory_iterator entry(folder / "scans", error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_directory()) present.push_back(entry->path());
  }
  for (const fs::path& path : present) {
    auto stored = read_stored(path);
    if (stored) {
      store.next_order_ = std::max(store.next_order_, stored->order + 1);
      store.files_.emplace(stored->file, std::move(*stored));
    } else {
      lost.push_back(stored.error().message);
      fs::remove_all(path, error);
    }
  }
  if (!fs::exists(folder / "live.json")) return store;
  ASBUILT_TRY(text, io::read_file(folder / "live.json"));
  const Json json = Json::parse(text, nullptr, false);
  const bool is_ours = json.is_object() && json.contains("removed") && json["removed"].is_object();
  if (!is_ours) {
    return fail(ErrorCode::unreadable_input,
                fmt::format("{}: is damaged, expected the list of files that were taken out; delete it to take all "
                            "files in",
                            (folder / "live.json").string()));
  }
  for (const auto& [file, sha256] : json["removed"].items()) {
    if (sha256.is_string()) store.removed_[file] = sha256.get<std::string>();
  }
  return store;
}

Result<fs::path> ScanStore::begin(const std::string& file) {
  const fs::path parent = folder_ / "unfinished";
  std::error_code error;
  fs::remove_all(parent, error);
  fs::create_directories(parent, error);
  if (error) return unwritable(parent, error);
  return parent / file;
}

Result<void> ScanStore::commit(const std::string& file, io::RunRecord record, std::optional<SensorLimits> limits) {
  const fs::path made = folder_ / "unfinished" / file, place = folder_of(file), old = folder_ / "replaced";
  const auto known = files_.find(file);
  const std::uint64_t order = known == files_.end() ? next_order_ : known->second.order;
  ASBUILT_CHECK(io::write_file(made / "live.json", sidecar(limits, order)));
  std::error_code error;
  fs::remove_all(old, error);
  fs::rename(place, old, error);  // killed here, the file is simply judged again
  error.clear();
  fs::rename(made, place, error);
  if (error) {
    std::error_code ignored;
    fs::rename(old, place, ignored);
    return unwritable(place, error);
  }
  sync_folder(folder_ / "scans");
  fs::remove_all(old, error);
  if (known == files_.end()) ++next_order_;
  files_[file] = {file, place, std::move(record), std::move(limits), order};
  return {};
}

void ScanStore::abandon() {
  std::error_code ignored;
  fs::remove_all(folder_ / "unfinished", ignored);
}

Result<void> ScanStore::erase(const std::string& file) {
  std::error_code error;
  const fs::path old = folder_ / "replaced";
  fs::remove_all(old, error);
  fs::rename(folder_of(file), old, error);
  if (error && fs::exists(folder_of(file))) return unwritable(folder_of(file), error);
  sync_folder(folder_ / "scans");
  fs::remove_all(old, error);
  files_.erase(file);
  return {};
}

Result<void> ScanStore::set_removed(const std::string& file, std::optional<std::string> sha256) {
  auto changed = removed_;
  if (sha256) {
    changed[file] = *sha256;
  } else {
    changed.erase(file);
  }
  Json json{{"removed", Json::object()}};
  for (const auto& [name, hash] : changed) json["removed"][name] = hash;
  ASBUILT_CHECK(io::write_file(folder_ / "live.json", json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"));
  removed_ = std::move(changed);
  return {};
}

}  // namespace asbuilt::live
