// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <new>
#include <system_error>
#include <utility>

namespace asbuilt::io {
namespace {

namespace fs = std::filesystem;

std::string reason_of(int error_number) { return std::generic_category().message(error_number); }

/// An open file that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] bool open() const { return descriptor_ >= 0; }
  [[nodiscard]] int get() const { return descriptor_; }
  /// False with errno when the last bytes could not be written (network and full disks tell only here).
  bool close() {
    const bool closed = descriptor_ < 0 || ::close(descriptor_) == 0;
    descriptor_ = -1;
    return closed;
  }

 private:
  int descriptor_;
};

/// Appends until the end of the file; 0, or the errno of the failure.
int read_to_end(int descriptor, std::string& content) {
  std::size_t filled = 0;
  while (true) {
    // One byte of room more than expected, so that the end is met without growing.
    if (filled == content.size()) content.resize(std::max<std::size_t>(2 * filled, 1 << 16));
    const ssize_t got = ::read(descriptor, content.data() + filled, content.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  content.resize(filled);
  return 0;
}

int write_all(int descriptor, std::string_view content) {
  while (!content.empty()) {
    const ssize_t put = ::write(descriptor, content.data(), content.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(put));
  }
  return 0;
}

/// A name beside `path` that no other writer uses, of this process or another.
fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  fs::path temporary = path;
  temporary.replace_filename(
      fmt::format(".{}.{}.{}.tmp", path.filename().string().substr(0, 180), ::getpid(), counter++));
  return temporary;
}

/// Makes the renaming itself last; best effort, since some file systems cannot.
void sync_folder_of(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.open()) ::fsync(descriptor.get());
}

/// Writes and syncs the temporary; 0, or the errno of the failure.
int write_temporary(const fs::path& temporary, std::string_view content) {
  Descriptor descriptor(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!descriptor.open()) return errno;
  if (const int error = write_all(descriptor.get(), content)) return error;
  if (::fsync(descriptor.get()) != 0 && errno != EINVAL && errno != ENOTSUP) return errno;
  return descriptor.close() ? 0 : errno;
}

}  // namespace

Result<std::string> read_file(const fs::path& path) {
  const auto unreadable = [&](std::string_view why) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", path.string(), why));
  };
  const Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!descriptor.open() && errno == ENOENT) return unreadable("there is no such file");
  if (!descriptor.open()) return unreadable(fmt::format("cannot be opened: {}", reason_of(errno)));

  struct stat status {};
  if (::fstat(descriptor.get(), &status) != 0) return unreadable(reason_of(errno));
  if (S_ISDIR(status.st_mode)) return unreadable("is a folder, expected a file");
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) return unreadable("is a device, expected a file");
  try {
    std::string content(static_cast<std::size_t>(std::max<off_t>(status.st_size, 0)) + 1, '\0');
    if (const int error = read_to_end(descriptor.get(), content)) {
      return unreadable(fmt::format("cannot be read: {}", reason_of(error)));
    }
    return content;
  } catch (const std::bad_alloc&) {
    return unreadable(fmt::format("{} bytes do not fit into memory", status.st_size));
  }
}

Result<FileContent> FileContent::open(const fs::path& path) {
  constexpr std::uintmax_t kSmallestMapped = 64u << 20;
  FileContent content;
  content.name_ = path.string();
  std::error_code ignored;
  const bool is_large = fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) >= kSmallestMapped;
  const Descriptor descriptor(is_large ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC) : -1);
  struct stat status {};
  if (descriptor.open() && ::fstat(descriptor.get(), &status) == 0 && status.st_size > 0) {
    content.map_ = FileMap::open(descriptor.get(), static_cast<std::size_t>(status.st_size));
    if (content.map_) return content;
  }
  ASBUILT_TRY(copy, read_file(path));  // also says what is wrong with a file that cannot be opened
  content.copy_ = std::move(copy);
  return content;
}

Result<void> FileContent::whole() const {
  if (!map_ || !map_->was_cut_short()) return {};
  return fail(ErrorCode::unreadable_input,
              fmt::format("{}: the file was cut short while it was read; is another program writing it? Read it again "
                          "when it is complete",
                          name_));
}

Result<void> write_file(const fs::path& path, std::string_view content) {
  const auto unwritable = [&](std::string_view why) {
    return fail(ErrorCode::unwritable_output, fmt::format("{}: cannot be written: {}", path.string(), why));
  };
  if (!path.has_filename()) return unwritable("this names no file");
  std::error_code ignored;
  const fs::file_status present = fs::status(path, ignored);
  // Renaming over a device would replace it.
  if (fs::exists(present) && !fs::is_regular_file(present)) {
    return unwritable(fs::is_directory(present) ? "there is a folder of that name" : "it is not a regular file");
  }
  const fs::path temporary = temporary_beside(path);
  int error = write_temporary(temporary, content);
  if (error == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    return unwritable(error == ENOENT ? "its folder does not exist" : reason_of(error));
  }
  sync_folder_of(path);
  return {};
}

}  // namespace asbuilt::io
