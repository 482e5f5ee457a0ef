// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/unit.h"

#include <fmt/format.h>

namespace asbuilt::io {

double millimetres_per(Unit unit) {
  switch (unit) {
    case Unit::stated:
    case Unit::millimetre:
      return 1.0;
    case Unit::centimetre:
      return 10.0;
    case Unit::metre:
      return 1000.0;
    case Unit::inch:
      return 25.4;
    case Unit::foot:
      return 304.8;
  }
  throw std::logic_error("asbuilt: expected a unit of length");
}

Result<Unit> unit_from_name(std::string_view name) {
  if (name == "mm") return Unit::millimetre;
  if (name == "cm") return Unit::centimetre;
  if (name == "m") return Unit::metre;
  if (name == "inch" || name == "in") return Unit::inch;
  if (name == "foot" || name == "ft") return Unit::foot;
  return fail(ErrorCode::invalid_argument,
              fmt::format("'{}' is no unit of length, expected mm, cm, m, inch or foot", name));
}

std::string_view name_of(Unit unit) {
  switch (unit) {
    case Unit::stated:
      return "stated";
    case Unit::millimetre:
      return "mm";
    case Unit::centimetre:
      return "cm";
    case Unit::metre:
      return "m";
    case Unit::inch:
      return "inch";
    case Unit::foot:
      return "foot";
  }
  throw std::logic_error("asbuilt: expected a unit of length");
}

}  // namespace asbuilt::io
