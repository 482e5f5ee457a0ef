// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "unit/io/bytes.h"
#include "unit/io/e57_bytes.h"
#include "unit/io/las_bytes.h"
#include "unit/io/png_bytes.h"

namespace asbuilt::test {

/// A small valid file: where fuzzing starts, and what hostile input is made from.
struct Seed {
  std::string family;  ///< the fuzz target that reads it
  std::string name;    ///< with the extension that tells its kind
  std::string content;
  std::size_t points = 0;
  bool is_mesh = false;
  bool declares_count = true;  ///< otherwise a file cut at the end of a line looks like a whole one
};

inline std::string ply_seed(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\ncomment seed\nelement camera 1\nproperty list uchar short size\nelement vertex 4\nproperty double x\n"
         "property float y\nproperty short z\nproperty float nx\nproperty float ny\nproperty float nz\n"
         "element face 2\nproperty uchar flag\nproperty list uchar int vertex_indices\nend_header\n";
}

inline std::string ply_binary_seed(bool is_big) {
  std::string content = ply_seed(is_big ? "binary_big_endian" : "binary_little_endian");
  const auto put = [&](auto value) { content += is_big ? big(value) : little(value); };
  put(std::uint8_t{2}), put(std::int16_t{3}), put(std::int16_t{4});
  for (const int i : {0, 1, 2, 3}) {
    put(0.5 * i), put(static_cast<float>(i % 2)), put(static_cast<std::int16_t>(i));
    for (const float n : {0.f, 0.f, 1.f}) put(n);
  }
  put(std::uint8_t{1}), put(std::uint8_t{3});
  for (const std::int32_t i : {0, 1, 2}) put(i);
  put(std::uint8_t{0}), put(std::uint8_t{4});
  for (const std::int32_t i : {0, 1, 2, 3}) put(i);
  return content;
}

inline std::string ply_ascii_seed() {
  return ply_seed("ascii") +
         "2 3 4\n0 0 0 0 0 1\n0.5 1 1 0 0 1\n1 0 2 0 0 1\n1.5e0 1 3 0 0 1\n1 3 0 1 2\n0 4 0 1 2 3\n";
}

inline std::string pcd_head(const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z flag\nSIZE 4 4 8 1\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 2\n"
         "VIEWPOINT 1 2 3 1 0 0 0\nPOINTS 4\nDATA " +
         data + "\n";
}

inline std::string pcd_binary_seed() {
  std::string content = pcd_head("binary");
  for (const int i : {0, 1, 2, 3}) content += little(static_cast<float>(i)) + little(1.5f) + little(-2.0 * i) + "\1\2";
  return content;
}

/// Four points as LZF: literals, and a repetition where the data repeat.
inline std::string pcd_compressed_seed() {
  std::string stream = "\x0f";
  for (const int i : {0, 1, 2, 3}) stream += little(static_cast<float>(i));
  stream += '\x03' + little(1.5f);
  stream += std::string("\xe0\x03\x03", 3);  // 7 + 3 + 2 = 12 bytes from 4 back: 1.5f three times
  stream += '\x1f';
  for (const int i : {0, 1, 2, 3}) stream += little(-2.0 * i);
  stream += std::string("\x07\1\2\1\2\1\2\1\2", 9);
  return pcd_head("binary_compressed") + little(static_cast<std::uint32_t>(stream.size())) + little(std::uint32_t{72}) +
         stream;
}

inline std::string stl_binary_seed() {
  std::string content = "solid seed" + std::string(70, ' ') + little(std::uint32_t{2});
  for (const float z : {0.f, 1.f}) {
    for (const float value : {0.f, 0.f, 1.f, 0.f, 0.f, z, 1.f, 0.f, z, 0.f, 1.f, z}) content += little(value);
    content += little(std::uint16_t{0});
  }
  return content;
}

/// Two scans: bits, a colour, an invalid state, a pose; then spherical coordinates with a grid.
inline std::string e57_seed() {
  E57Builder file;
  file.add_scan(
      R"(<cartesianX type="ScaledInteger" minimum="-3" maximum="28" scale="0.1"/>)"
      R"(<cartesianY type="Float" precision="single"/><cartesianZ type="Float"/>)"
      R"(<cartesianInvalidState type="Integer" minimum="0" maximum="2"/>)"
      R"(<colorRed type="Integer" minimum="0" maximum="255"/><colorGreen type="Integer" minimum="0" maximum="255"/>)"
      R"(<colorBlue type="Integer" minimum="0" maximum="255"/>)",
      3,
      {{packed({1, 2, 3}, 5), little(1.f) + little(2.f) + little(3.f), little(4.0) + little(5.0) + little(6.0),
        packed({0, 2, 0}, 2), "abc", "def", "ghi"}},
      2,
      R"(<name type="String"><![CDATA[a]]></name><pose type="Structure"><rotation type="Structure">)"
      R"(<w type="Float">1</w></rotation><translation type="Structure"><x type="Float">5</x></translation></pose>)");
  const std::string two = little(1.0) + little(2.0);
  file.add_scan(
      R"(<sphericalRange type="Float"/><sphericalAzimuth type="Float"/><sphericalElevation type="Float"/>)"
      R"(<rowIndex type="Integer" minimum="0" maximum="7"/><columnIndex type="Integer" minimum="0" maximum="7"/>)"
      R"(<intensity type="Float" precision="single"/>)",
      2, {{two, two, two, packed({0, 1}, 3), packed({2, 5}, 3), little(0.5f) + little(0.25f)}});
  return file.bytes();
}

inline std::string ptx_seed() {
  const std::string scan =
      "2\n1\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n4 5 6 0.5 10 20 30\n0 0 0 0.5 0 0 0\n";
  return scan + scan;
}

inline std::string depth_seed() { return png(2, 3, std::string("\0\x03\xe8\x03\xe9\1\x03\xe8\0\2\4\0\1\0\1", 15)); }

// What a live session keeps: the files that were taken out; what a scan told of its sensor; the record of a scan.
inline constexpr const char* kRemovedSeed = R"({"removed": {"a.ply": "00ff"}})";
inline constexpr const char* kSensorSeed =
    R"({"order": 3, "sensor": {"half_angle": 25.5, "near": 300.0, "far": 1400.0, "distance": 690.0}})";
inline constexpr const char* kRecordSeed = R"({"asbuilt": {"version": "0.1.0", "schema": 1}, "state": "complete",
"unit": "mm", "options": {"unit": "stated", "memory": 0.5, "exclude": ["b"], "mesh": false, "seed": 1},
"model": {"path": "m.ply", "sha256": "9b", "triangles": 12, "diameter": 478.2, "sampling_distance": 17.0,
"symmetry": "none"}, "scans": [{"path": "a.ply", "name": "a", "index_in_file": 0, "scans_in_file": 1, "instance": 1,
"instances_in_scan": 1, "sha256": "ae", "points": 9, "viewpoint": [0, 0, 0], "viewpoint_kind": "point",
"normals_oriented": true, "noise_sigma": 0.1, "spacing": 0.3, "offset": [0, 0, 0], "status": "rejected",
"reason_code": "low_score", "reason": "no", "model_from_scan_detected": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],
"model_from_scan": null, "covariance": null, "component": null, "hold_sigma": [], "loose_motions": [], "votes": 1.5,
"score": 0.9, "visible_share": 0.2, "free_space_violations": 0, "normal_agreement": 1, "margin": 0.1, "candidates": [],
"segment_points": 0, "warnings": ["w"]}]})";

/// A request as it comes over the wire, after the letter of the server that it goes to.
inline std::string http_seed(const std::string& method, const std::string& target, const std::string& more = {},
                             const std::string& body = {}, char server = 'o') {
  return server + method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n" + body;
}

inline std::vector<Seed> seeds() {
  return {
      {"ply", "ascii.ply", ply_ascii_seed(), 4, true, true},
      {"ply", "little.ply", ply_binary_seed(false), 4, true, true},
      {"ply", "big.ply", ply_binary_seed(true), 4, true, true},
      {"pcd", "ascii.pcd", pcd_head("ascii") + "0 1.5 -0 1 2\n1 1.5 -2 1 2\nnan 1.5 -4 1 2\n3 1.5 -6 1 2\n", 4, false,
       true},
      {"pcd", "binary.pcd", pcd_binary_seed(), 4, false, true},
      {"pcd", "compressed.pcd", pcd_compressed_seed(), 4, false, true},
      {"text", "blanks.xyz", "# seed\n1 2 3\n4.5 -5 6e1\n7\t8 nan\n", 3, false, false},
      {"text", "normals.asc", "//X Y Z Nx Ny Nz\n1 2 3 0 0 1\n4 5 6 0 1 0\n", 2, false, false},
      {"text", "counted.pts", "3\n1 2 3 0.5 10 20 30\n4 5 6 0.5 10 20 30\n7 8 9 0.5 10 20 30\n", 3, false, true},
      {"text", "blocks.pts", "1\n1 2 3 0.5\n2\n4 5 6 0.5\n7 8 9 0.5\n", 3, false, false},
      {"text", "header.csv", "x;y;z;name\n1,5;2;3;0\n4000000,25;5;;0\n", 2, false, false},
      {"mesh", "binary.stl", stl_binary_seed(), 6, true, true},
      {"mesh", "ascii.stl",
       "solid seed\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
       "0\nendloop\nendfacet\nendsolid "
       "seed\n",
       3, true, true},
      {"mesh", "quad.off", "OFF # seed\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n", 4, true, true},
      {"mesh", "quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 -2//1 \\\n 4//1\n", 4, true,
       false},
      {"e57", "two.e57", e57_seed(), 5, false, true},
      {"ptx", "two.ptx", ptx_seed(), 4, false, false},
      {"las", "two.las", las(3, 2), 3, false, true},
      {"las", "four.las", las(7, 4), 3, false, true},
      {"depth", "depth.png", depth_seed(), 6, false, true},
      {"gzip", "scan.xyz.gz", gzipped("1 2 3\n4 5 6\n"), 2, false, true},
      {"pose", "poses.csv", "name,matrix\na,0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1\n"},
      {"pose", "poses.json", R"([{"scan": "a", "model_from_scan": [[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]}])"},
      {"pose", "viewpoints.csv", "name,x,y,z\na,1,2,3\nb,4,5,6\n"},
  };
}

/// Of the targets that read no files of points.
inline std::vector<Seed> live_seeds() {
  return {
      {"state", "removed.json", std::string("r") + kRemovedSeed},
      {"state", "sensor.json", std::string("s") + kSensorSeed},
      {"state", "record.json", std::string("d") + kRecordSeed},
      {"http", "state", http_seed("GET", "/state")},
      {"http", "elsewhere", "oGET /state HTTP/1.1\r\nHost: a.example\r\n\r\n"},
      {"http", "events", http_seed("GET", "/events", "Origin: http://localhost\r\n")},
      {"http", "values", http_seed("GET", "/surface/values?revision=1", "Authorization: Bearer x\r\n", "", 't')},
      {"http", "token", http_seed("GET", "/state?token=0f5a", "", "", 't')},
      {"http", "guarded_upload", http_seed("POST", "/scans?name=e.ply&token=x", "Content-Length: 4\r\n", "ply\n", 't')},
      {"http", "traversal", http_seed("POST", "/scans?name=..%2Fbeside.ply", "Content-Length: 4\r\n", "ply\n")},
      {"http", "two_requests",
       http_seed("GET", "/nothing", "Content-Length: 40\r\n", "DELETE /scans/known.ply HTTP/1.1\r\nHost: a\r\n\r\n")},
      {"http", "upload", http_seed("POST", "/scans?name=a%20b.ply", "Content-Length: 5\r\n", "ply\n0")},
      {"http", "chunked",
       http_seed("POST", "/scans?name=c.xyz", "Transfer-Encoding: chunked\r\n", "3\r\n1 2\r\n0\r\n\r\n")},
      {"http", "form",
       http_seed("POST", "/scans?name=d.ply", "Content-Length: 9\r\nContent-Type: multipart/form-data; boundary=x\r\n",
                 "--x\r\n\r\n--")},
      {"http", "delete", http_seed("DELETE", "/scans/known.ply")},
      {"http", "restore", http_seed("POST", "/scans/known.ply/restore", "Content-Length: 0\r\n")},
      {"http", "result", http_seed("POST", "/result", "Content-Length: 0\r\nRange: bytes=0-1\r\n")},
  };
}

}  // namespace asbuilt::test
