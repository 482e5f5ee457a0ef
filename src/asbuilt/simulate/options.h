// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "asbuilt/core/result.h"
#include "asbuilt/simulate/as_built.h"
#include "asbuilt/simulate/scanner.h"

namespace asbuilt::simulate {

/// What to simulate. Ratios are shares of the model's diameter. Defaults: a workshop with moderate clutter.
struct SimulateOptions {
  int scans = 8;                            ///< [1, 10000]
  std::string sensor = "structured-light";  ///< or "laser-scanner"
  int points = 120000;                      ///< about so many a scan, [100, 1e8]
  std::uint64_t seed = 1;
  std::string pose = "resting";  ///< "upright" (model z up), "resting" (as it may lie) or "any", each scan anew

  double noise_ratio = 0.0005;  ///< axial sigma, straight on at the middle distance / diameter, [0, 0.05]
  double noise_mm = 0.0;        ///< the same in mm, in its place if > 0
  double lateral_noise = 0.25;  ///< sigma across the ray / axial sigma, [0, 1]
  double quantum = 0.25;        ///< rounding of ranges / axial sigma at the middle distance, [0, 10]
  double flying_share = 0.1;    ///< of the rays on depth edges that give a point in mid air, [0, 1]
  double dropout_share = 0.01;  ///< of all rays that give nothing, [0, 0.9]

  int clutter_objects = 8;     ///< other things in each scan, about (varied to meet the range of clutter), [0, 200]
  double clutter_low = 0.6;    ///< structured light: the share of the scene that is not the part ...
  double clutter_high = 0.85;  ///< ... is kept in this range where it can be; a laser scanner sees its whole hall
  double hidden_low = 0.0;     ///< share of the otherwise visible part that other things cover ...
  double hidden_high = 0.2;    ///< ... drawn from this range for each scan
  int instances = 1;           ///< placements of the part in each scan that shows it, [1, 10]
  bool floor = true;
  bool walls = false;         ///< structured light only; a laser scanner always stands in a hall
  double absent_share = 0.0;  ///< share of scans without the part, [0, 1]
  int decoys = 0;             ///< copies of the part, but of another size or mirrored, in each scan, [0, 20]
  double decoy_scale = 0.78;  ///< size of a decoy / size of the part, [0.1, 2]
  bool decoy_mirrored = false;

  AsBuiltOptions as_built;

  [[nodiscard]] Result<void> validate() const;
  [[nodiscard]] SensorKind sensor_kind() const {
    return sensor == "laser-scanner" ? SensorKind::laser_scanner : SensorKind::structured_light;
  }
};

template <class Visitor>
void for_each_field(SimulateOptions& options, Visitor&& field) {
  field("scans", options.scans, "number of scans");
  field("sensor", options.sensor, "structured-light or laser-scanner");
  field("points", options.points, "points of a scan, about");
  field("seed", options.seed, "seed of all random numbers");
  field("pose", options.pose, "how the part stands: upright, resting or any");
  field("noise_ratio", options.noise_ratio, "axial noise (1 sigma) at the middle distance / diameter");
  field("noise_mm", options.noise_mm, "the same in mm, in its place if not 0");
  field("lateral_noise", options.lateral_noise, "noise across the ray / axial noise");
  field("quantum", options.quantum, "rounding of ranges / axial noise");
  field("flying_share", options.flying_share, "share of rays on depth edges that give a flying point");
  field("dropout_share", options.dropout_share, "share of rays that give nothing");
  field("clutter_objects", options.clutter_objects, "other things in each scan, about");
  field("clutter_low", options.clutter_low, "least share of the scene that is not the part (structured light)");
  field("clutter_high", options.clutter_high, "greatest share of the scene that is not the part (structured light)");
  field("hidden_low", options.hidden_low, "least share of the visible part that is covered");
  field("hidden_high", options.hidden_high, "greatest share of the visible part that is covered");
  field("instances", options.instances, "placements of the part in each scan that shows it");
  field("floor", options.floor, "a floor under everything");
  field("walls", options.walls, "walls around everything (always with a laser scanner)");
  field("absent_share", options.absent_share, "share of scans without the part");
  field("decoys", options.decoys, "copies of another size or mirrored in each scan");
  field("decoy_scale", options.decoy_scale, "size of a decoy / size of the part");
  field("decoy_mirrored", options.decoy_mirrored, "decoys are mirror images");
  for_each_field(options.as_built, field);
}

}  // namespace asbuilt::simulate
