// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/sha256.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "asbuilt/io/file.h"
#include "asbuilt/io/file_map.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>
#include <immintrin.h>
#define ASBUILT_SHA_INSTRUCTIONS 1
#endif

namespace asbuilt::io {
namespace {

using Words = Sha256::Words;

/// FIPS 180-4, 4.2.2: the fractional parts of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, 64> kRoundConstants{
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

/// FIPS 180-4, 5.3.3.
constexpr Words kInitialHash{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                             0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};

std::uint32_t big_endian_word(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

/// FIPS 180-4, 6.2.2, steps 1 to 4 for one block of 64 bytes.
void add_block(Words& hash, const unsigned char* block) {
  std::array<std::uint32_t, 64> w;
  for (std::size_t t = 0; t < 16; ++t) w[t] = big_endian_word(block + 4 * t);
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ (w[t - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ (w[t - 2] >> 10);
    w[t] = s1 + w[t - 7] + s0 + w[t - 16];
  }
  auto [a, b, c, d, e, f, g, h] = hash;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t1 = h + sum1 + ((e & f) ^ (~e & g)) + kRoundConstants[t] + w[t];
    const std::uint32_t t2 = sum0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const Words added{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < 8; ++i) hash[i] += added[i];
}

#ifdef ASBUILT_SHA_INSTRUCTIONS

/// Leaf 7: SHA; leaf 1: SSSE3 and SSE4.1, which bring the bytes into order.
bool has_sha_instructions() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & bit_SSSE3) == 0 || (c & bit_SSE4_1) == 0) return false;
  constexpr unsigned kSha = 1u << 29;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (b & kSha) != 0;
}

/// The same as add_block, four rounds at a time. The instructions want the words a to h as (f e b a) and (h g d c),
/// from the lowest place on.
__attribute__((target("sha,ssse3,sse4.1"))) void add_blocks_quickly(Words& hash, const unsigned char* blocks,
                                                                    std::size_t count) {
  const auto word = [&](std::size_t i) { return static_cast<int>(hash[i]); };
  __m128i feba = _mm_set_epi32(word(0), word(1), word(4), word(5));
  __m128i hgdc = _mm_set_epi32(word(2), word(3), word(6), word(7));
  const __m128i from_big_endian = _mm_set_epi8(12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3);
  for (; count > 0; --count, blocks += 64) {
    const __m128i feba_before = feba, hgdc_before = hgdc;
    __m128i w[16];
    for (int quad = 0; quad < 16; ++quad) {
      if (quad < 4) {
        w[quad] =
            _mm_shuffle_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(blocks + 16 * quad)), from_big_endian);
      } else {
        const __m128i seven_before = _mm_alignr_epi8(w[quad - 1], w[quad - 2], 4);
        const __m128i sum = _mm_add_epi32(_mm_sha256msg1_epu32(w[quad - 4], w[quad - 3]), seven_before);
        w[quad] = _mm_sha256msg2_epu32(sum, w[quad - 1]);
      }
      const __m128i constants = _mm_loadu_si128(reinterpret_cast<const __m128i*>(kRoundConstants.data() + 4 * quad));
      const __m128i added = _mm_add_epi32(w[quad], constants);
      hgdc = _mm_sha256rnds2_epu32(hgdc, feba, added);
      feba = _mm_sha256rnds2_epu32(feba, hgdc, _mm_shuffle_epi32(added, 0x0E));
    }
    feba = _mm_add_epi32(feba, feba_before);
    hgdc = _mm_add_epi32(hgdc, hgdc_before);
  }
  alignas(16) std::array<std::uint32_t, 4> low, high;
  _mm_store_si128(reinterpret_cast<__m128i*>(low.data()), feba);
  _mm_store_si128(reinterpret_cast<__m128i*>(high.data()), hgdc);
  hash = {low[3], low[2], high[3], high[2], low[1], low[0], high[1], high[0]};
}

#endif

}  // namespace

void Sha256::add_blocks_plainly(Words& hash, const unsigned char* blocks, std::size_t count) {
  for (; count > 0; --count, blocks += 64) add_block(hash, blocks);
}

Sha256::AddBlocks Sha256::add_blocks_by_instructions() {
#ifdef ASBUILT_SHA_INSTRUCTIONS
  static const bool is_there = has_sha_instructions();
  if (is_there) return add_blocks_quickly;
#endif
  return nullptr;
}

Sha256::Sha256() : Sha256(add_blocks_by_instructions()) {}

Sha256::Sha256(AddBlocks add_blocks)
    : add_blocks_(add_blocks != nullptr ? add_blocks : add_blocks_plainly), hash_(kInitialHash) {}

void Sha256::add(std::string_view bytes) {
  const auto held = static_cast<std::size_t>(size_ % rest_.size());
  size_ += bytes.size();
  if (held > 0) {
    const std::size_t taken = std::min(bytes.size(), rest_.size() - held);
    std::memcpy(rest_.data() + held, bytes.data(), taken);
    bytes.remove_prefix(taken);
    if (held + taken < rest_.size()) return;
    add_blocks_(hash_, rest_.data(), 1);
  }
  const std::size_t whole = bytes.size() / rest_.size();
  add_blocks_(hash_, reinterpret_cast<const unsigned char*>(bytes.data()), whole);
  bytes.remove_prefix(whole * rest_.size());
  if (!bytes.empty()) std::memcpy(rest_.data(), bytes.data(), bytes.size());
}

std::string Sha256::digest() {
  // 5.1.1: a one bit, zeros, and the length in bits fill one or two blocks.
  std::array<unsigned char, 128> tail{};
  const auto rest = static_cast<std::size_t>(size_ % rest_.size());
  std::memcpy(tail.data(), rest_.data(), rest);
  tail[rest] = 0x80;
  const std::size_t tail_size = rest < 56 ? 64 : 128;
  for (std::size_t i = 0; i < 8; ++i) tail[tail_size - 1 - i] = static_cast<unsigned char>(8 * size_ >> (8 * i));
  add_blocks_(hash_, tail.data(), tail_size / 64);
  std::string text;
  for (const std::uint32_t word : hash_) {
    for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[(word >> shift) & 0xf];
  }
  return text;
}

std::string sha256(std::string_view content) {
  // In pieces, so that a mapped file does not have to stay in memory whole.
  constexpr std::size_t kPiece = std::size_t{64} << 20;
  Sha256 hash;
  for (std::size_t begin = 0; begin < content.size(); begin += kPiece) {
    const std::string_view piece = content.substr(begin, kPiece);
    hash.add(piece);
    release_pages(piece);
  }
  return hash.digest();
}

}  // namespace asbuilt::io
