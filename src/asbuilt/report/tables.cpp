// SPDX-License-Identifier: Apache-2.0
// The CSV twins: commas, decimal points, text in quotes where it needs them; empty fields for what is unknown.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/report/describe.h"
#include "asbuilt/report/report.h"

namespace asbuilt::report {
namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : std::string(); }
std::string number(const std::optional<double>& value) { return value ? number(*value) : std::string(); }

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

std::string triple(const Eigen::Vector3d& v) {
  return fmt::format("{},{},{}", number(v.x()), number(v.y()), number(v.z()));
}

std::string part_line(std::string_view kind, const inspect::SurfacePart& part) {
  const inspect::DeviationStatistics& s = part.statistics;
  const auto known = [&](double value) { return s.count > 0 ? number(value) : std::string(); };
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", kind, csv_field(part.name),
                     part.verdict ? std::string(inspect::name_of(*part.verdict)) : std::string(), number(part.area_mm2),
                     number(part.coverage()), part.spots, part.spots_scanned,
                     part.tolerance ? number(part.tolerance->low_mm) : "",
                     part.tolerance ? number(part.tolerance->high_mm) : "", number(s.in_tolerance), known(s.mean),
                     known(s.sigma), known(s.rms), known(s.min), known(s.max), known(s.p95), triple(part.centre));
}

}  // namespace

std::string spots_csv(const ReportInput& input) {
  const inspect::DeviationReport& deviations = input.deviations;
  const PointCloud& places = input.model.dense_samples;
  std::string text = "x,y,z,nx,ny,nz,deviation,standard_error,points,scans,scan,face,region\n";
  for (std::size_t i = 0; i < deviations.spots.size(); ++i) {
    const inspect::Spot& spot = deviations.spots[i];
    text += fmt::format("{:.7g},{:.7g},{:.7g},{:.5g},{:.5g},{:.5g},", places.positions[i].x(), places.positions[i].y(),
                        places.positions[i].z(), places.normals[i].x(), places.normals[i].y(), places.normals[i].z());
    if (spot.is_scanned()) {
      text += fmt::format("{:.7g},", spot.deviation_mm);
      text += std::isfinite(spot.standard_error_mm) ? fmt::format("{:.5g},", spot.standard_error_mm) : ",";
      text += fmt::format("{},{},", spot.points, spot.scans);
      text += spot.scan != inspect::Spot::kNoScan ? fmt::format("{},", spot.scan) : ",";
    } else {
      text += ",,0,0,,";
    }
    text += fmt::format("{},", deviations.face_of_spot[i]);
    text += deviations.region_of_spot[i] >= 0 ? fmt::format("{}\n", deviations.region_of_spot[i]) : "\n";
  }
  return text;
}

std::string faces_csv(const ReportInput& input) {
  std::string text =
      "kind,name,verdict,area,coverage,spots,spots_scanned,low,high,in_tolerance,mean,sigma,rms,min,max,p95,x,y,z\n";
  for (const inspect::SurfacePart& face : input.deviations.faces) text += part_line("face", face);
  for (const inspect::SurfacePart& box : input.deviations.boxes) text += part_line("box", box);
  return text;
}

std::string regions_csv(const ReportInput& input) {
  std::string text =
      "region,area,spots,size_x,size_y,size_z,x,y,z,peak,peak_x,peak_y,peak_z,peak_standard_error,mean,limit,face,"
      "significant\n";
  for (std::size_t i = 0; i < input.deviations.regions.size(); ++i) {
    const inspect::Region& r = input.deviations.regions[i];
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", i, number(r.area_mm2), r.spots.size(),
                        triple(r.box.sizes()), triple(r.centre), number(r.peak.deviation_mm), triple(r.peak.point),
                        number(r.peak.standard_error_mm), number(r.mean_mm), number(r.limit_mm),
                        csv_field(input.deviations.faces[r.face].name), r.significant ? "yes" : "no");
  }
  return text;
}

std::string scans_csv(const ReportInput& input) {
  std::string text =
      "scan,name,path,status,reason_code,reason,points,segment_points,noise_sigma,score,visible_share,normal_agreement,"
      "component,links,best_overlap,residual,position_sigma,rotation_sigma_deg,spots,sha256\n";
  for (std::size_t i = 0; i < input.record.scans.size(); ++i) {
    const io::ScanRecord& scan = input.record.scans[i];
    const LinkSummary links = links_of(input.record, static_cast<int>(i));
    const PlaceError error = place_error(scan, input.model.box.center());
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", i, csv_field(scan.name),
                        csv_field(scan.path), io::name_of(scan.status), scan.reason_code, csv_field(scan.reason),
                        scan.points, scan.segment_points, number(scan.noise_sigma), number(scan.score),
                        number(scan.visible_share), number(scan.normal_agreement),
                        scan.component ? fmt::format("{}", *scan.component) : "", links.links,
                        number(links.best_overlap), number(links.residual_mm), number(error.position_mm),
                        number(error.rotation_deg), spots_of(input.deviations, i), scan.sha256);
  }
  return text;
}

std::string reference_csv(const ReportInput& input) {
  std::string text = "name,x,y,z,sigma,deviation,standard_error,status,significant\n";
  if (!input.deviations.reference) return text;
  const inspect::ReferenceReport& reference = *input.deviations.reference;
  for (std::size_t i = 0; i < reference.points.size(); ++i) {
    const inspect::ReferenceDeviation& d = reference.deviations[i];
    text +=
        fmt::format("{},{},{},{},{},{},{}\n", csv_field(reference.points[i].name), triple(reference.points[i].position),
                    number(reference.points[i].sigma_mm), d.measured ? number(d.deviation_mm) : "",
                    d.measured && d.standard_error_mm > 0.0 ? number(d.standard_error_mm) : "",
                    d.measured ? "measured" : "not scanned", d.significant ? (*d.significant ? "yes" : "no") : "");
  }
  return text;
}

}  // namespace asbuilt::report
