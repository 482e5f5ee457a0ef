// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/file_map.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <mutex>
#include <utility>

namespace asbuilt::io {
namespace {

/// What the signal handler may look at: atomics without locks only.
struct Slot {
  std::atomic<bool> taken{false};
  std::atomic<std::uintptr_t> begin{0}, end{0};  // page bounds; an empty range is no map
  std::atomic<bool> cut_short{false};
};
static_assert(std::atomic<std::uintptr_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

std::array<Slot, 64> slots;
struct sigaction earlier_action;

std::uintptr_t page_size() {
  static const auto size = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  return size;
}

/// Puts zeros in place of what is gone, from the page of the fault to the end of the map.
bool mend(std::uintptr_t address) {
  for (Slot& slot : slots) {
    if (address < slot.begin.load() || address >= slot.end.load()) continue;
    const std::uintptr_t from = address / page_size() * page_size();
    void* const place = reinterpret_cast<void*>(from);
    const std::size_t size = slot.end.load() - from;
    slot.cut_short = true;
    return ::mmap(place, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) == place;
  }
  return false;
}

void on_bus_error(int signal, siginfo_t* info, void* context) {
  if (mend(reinterpret_cast<std::uintptr_t>(info->si_addr))) return;
  if ((earlier_action.sa_flags & SA_SIGINFO) != 0 && earlier_action.sa_sigaction != nullptr) {
    earlier_action.sa_sigaction(signal, info, context);
  } else if (earlier_action.sa_handler != SIG_DFL && earlier_action.sa_handler != SIG_IGN) {
    earlier_action.sa_handler(signal);
  } else {
    // Not ours: the instruction is run again, and ends the program as if nobody had listened.
    ::sigaction(signal, &earlier_action, nullptr);
  }
}

void guard_maps() {
  static std::once_flag once;
  std::call_once(once, [] {
    page_size();  // known before a handler asks
    struct sigaction action {};
    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, &earlier_action);
  });
}

}  // namespace

std::optional<FileMap> FileMap::open(int descriptor, std::size_t size) {
  guard_maps();
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (slots[i].taken.exchange(true)) continue;
    void* const map = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
    if (map == MAP_FAILED) {
      slots[i].taken = false;
      return std::nullopt;
    }
    ::madvise(map, size, MADV_SEQUENTIAL);
    const auto begin = reinterpret_cast<std::uintptr_t>(map);
    slots[i].cut_short = false;
    slots[i].begin = begin;
    slots[i].end = begin + (size + page_size() - 1) / page_size() * page_size();
    return FileMap(static_cast<const char*>(map), size, i);
  }
  return std::nullopt;
}

FileMap::FileMap(FileMap&& other) noexcept
    : begin_(std::exchange(other.begin_, nullptr)), size_(std::exchange(other.size_, 0)), slot_(other.slot_) {}

FileMap& FileMap::operator=(FileMap&& other) noexcept {
  std::swap(begin_, other.begin_);
  std::swap(size_, other.size_);
  std::swap(slot_, other.slot_);
  return *this;
}

FileMap::~FileMap() {
  if (begin_ == nullptr) return;
  slots[slot_].end = 0;
  slots[slot_].begin = 0;
  ::munmap(const_cast<char*>(begin_), size_);
  slots[slot_].taken = false;
}

bool FileMap::was_cut_short() const { return begin_ != nullptr && slots[slot_].cut_short.load(); }

void release_pages(std::string_view read) {
  const auto first = reinterpret_cast<std::uintptr_t>(read.data());
  for (const Slot& slot : slots) {
    if (first < slot.begin.load() || first + read.size() > slot.end.load()) continue;
    // Whole pages only, since the bytes beside them may still be wanted.
    const std::uintptr_t from = (first + page_size() - 1) / page_size() * page_size();
    const std::uintptr_t to = (first + read.size()) / page_size() * page_size();
    if (from < to) ::madvise(reinterpret_cast<void*>(from), to - from, MADV_DONTNEED);
    return;
  }
}

}  // namespace asbuilt::io
