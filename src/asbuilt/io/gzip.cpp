// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/gzip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

namespace asbuilt::io {
namespace {

constexpr int kGzipOnly = 16 + MAX_WBITS;

/// An inflating stream that frees itself.
class Inflater {
 public:
  Inflater(std::string_view packed, int window_bits) : rest_(packed) {
    if (::inflateInit2(&stream_, window_bits) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { ::inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Fills `out` as far as it goes; Z_OK, Z_STREAM_END, or what went wrong. `written` tells how far.
  int fill(char* out, std::size_t size, std::size_t& written) {
    constexpr std::size_t kMost = std::numeric_limits<uInt>::max() / 2;
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = static_cast<uInt>(std::min(size, kMost));
    const uInt offered_out = stream_.avail_out;
    const auto offered_in = static_cast<uInt>(std::min(rest_.size(), kMost));
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest_.data()));
    stream_.avail_in = offered_in;
    const int code = ::inflate(&stream_, Z_NO_FLUSH);
    rest_.remove_prefix(offered_in - stream_.avail_in);
    written = offered_out - stream_.avail_out;
    return code;
  }
  void begin_member() { ::inflateReset(&stream_); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  z_stream stream_{};
  std::string_view rest_;
};

}  // namespace

bool is_gzip(std::string_view content) { return content.starts_with("\x1f\x8b"); }

std::filesystem::path name_without_gz(const std::filesystem::path& path) {
  return lower_case(path.extension().string()) == ".gz" ? path.parent_path() / path.stem() : path;
}

Result<std::string> gunzip(const Input& input) {
  try {
    Inflater inflater(input.content, kGzipOnly);
    std::string content;
    std::size_t filled = 0;
    while (true) {
      if (filled == content.size()) content.resize(std::max<std::size_t>(2 * filled, 1 << 16));
      std::size_t written = 0;
      const int code = inflater.fill(content.data() + filled, content.size() - filled, written);
      filled += written;
      const std::size_t byte = input.content.size() - inflater.rest().size();
      if (code == Z_STREAM_END) {
        if (!is_gzip(inflater.rest())) break;  // what follows the last member is padding
        inflater.begin_member();
      } else if (code != Z_OK && code != Z_BUF_ERROR) {
        return input.error_at_byte(byte, "the gzip archive is damaged");
      } else if (written == 0 && inflater.rest().empty()) {
        return input.error_at_byte(byte, "the gzip archive ends too early, it seems to be truncated");
      }
    }
    content.resize(filled);
    return content;
  } catch (const std::bad_alloc&) {
    return input.error("what the gzip archive holds does not fit into memory");
  }
}

Result<std::string> inflate_to(const Input& input, std::string_view stream, std::size_t expected) {
  if (expected > largest_expansion(stream.size())) {
    return input.error(
        fmt::format("{} packed bytes can never expand to {}, the file seems to be truncated", stream.size(), expected));
  }
  Inflater inflater(stream, MAX_WBITS);
  std::string content(expected, '\0');
  std::size_t filled = 0;
  while (filled < expected) {
    std::size_t written = 0;
    const int code = inflater.fill(content.data() + filled, expected - filled, written);
    filled += written;
    if (code == Z_STREAM_END) break;
    if (code != Z_OK && code != Z_BUF_ERROR) return input.error("the packed data are damaged");
    if (written == 0) break;
  }
  if (filled == expected) return content;
  return input.error(
      fmt::format("the packed data end after {} of {} bytes, the file seems to be truncated", filled, expected));
}

}  // namespace asbuilt::io
