// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/io/point_sieve.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// What a user can say about a scan file that does not say it itself. A unit alone will do.
struct ReadOptions {
  Unit unit = Unit::stated;  ///< overrides what the file states
  std::string columns;       ///< of text files, "x,y,z,-,nx,ny,nz"; empty: from names in the file, else guessed
  std::string camera;        ///< of depth images, "fx,fy,cx,cy[,units per metre]" or a file; empty: a file beside it

  std::shared_ptr<const PointSieve> sieve;  ///< bounds what is kept of each scan; none: everything is
  std::optional<Context> context;           ///< whose threads share the decoding; none: one thread

  [[nodiscard]] Context threads() const { return context ? *context : Context(1); }

  ReadOptions() = default;
  ReadOptions(Unit of_the_file) : unit(of_the_file) {}  // NOLINT(google-explicit-constructor)
};

}  // namespace asbuilt::io
