// SPDX-License-Identifier: Apache-2.0
// STEP, IGES and BREP through OpenCASCADE: the only source that includes it.
#include "asbuilt/io/cad_mesh.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <unordered_map>
#include <utility>

#include "asbuilt/io/file.h"
#include "asbuilt/io/polygons.h"
#include "asbuilt/io/step_text.h"

// The library's headers are not ours to mend.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepShape_FaceSurface.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#pragma GCC diagnostic pop

namespace asbuilt::io {
namespace {

constexpr double kCoarseTolerance = 2e-3;  // of the box, only to learn the diameter
constexpr double kAngle = 0.3;             // radians between neighbouring triangles of a curved face

/// OpenCASCADE keeps readers, units and printers in static variables: one file at a time.
std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// The library prints to standard output; a library of ours never does.
void silence_library() {
  static const bool done = [] {
    Message::DefaultMessenger()->ChangePrinters().Clear();
    return true;
  }();
  static_cast<void>(done);
}

/// A shape in millimetres, and what its file says of its unit.
struct CadShape {
  TopoDS_Shape shape;
  std::optional<double> stated_mm;  ///< millimetres in the unit that the file states
  std::string stated_name;
  CadFaceNames face_names;
};

std::optional<double> millimetres_in(std::string name) {
  name = lower_case(name);
  constexpr std::pair<std::string_view, double> kKnown[] = {
      {"millimetre", 1.0},  {"millimeter", 1.0}, {"mm", 1.0},        {"centimetre", 10.0}, {"centimeter", 10.0},
      {"cm", 10.0},         {"metre", 1000.0},   {"meter", 1000.0},  {"m", 1000.0},        {"inch", 25.4},
      {"in", 25.4},         {"foot", 304.8},     {"feet", 304.8},    {"ft", 304.8},        {"micrometre", 1e-3},
      {"micrometer", 1e-3}, {"um", 1e-3},        {"kilometre", 1e6}, {"km", 1e6},          {"mil", 0.0254}};
  for (const auto& [known, millimetres] : kKnown) {
    if (name == known) return millimetres;
  }
  return std::nullopt;
}

using NamesOfShapes = std::unordered_map<const TopoDS_TShape*, std::string>;

std::string name_in(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : clean_cad_name(decoded_step_text(text->ToCString()));
}

/// What the file says of the shapes that came of it: the first string of a face, and the product of a part.
struct NamesInStep {
  NamesOfShapes of_faces, of_parts;

  explicit NamesInStep(const Handle(Transfer_TransientProcess) & transferred) {
    for (int i = 1; i <= transferred->NbMapped(); ++i) {
      const Handle(Standard_Transient) entity = transferred->Mapped(i);
      const auto face = Handle(StepShape_FaceSurface)::DownCast(entity);
      const auto part = Handle(StepBasic_ProductDefinition)::DownCast(entity);
      if (face.IsNull() && part.IsNull()) continue;
      const TopoDS_Shape shape = TransferBRep::ShapeResult(transferred, entity);
      if (shape.IsNull()) continue;
      const std::string name = face.IsNull() ? product_of(part) : name_in(face->Name());
      if (!name.empty()) (face.IsNull() ? of_parts : of_faces).emplace(shape.TShape().get(), name);
    }
  }

 private:
  static std::string product_of(const Handle(StepBasic_ProductDefinition) & definition) {
    const auto formation = definition->Formation();
    if (formation.IsNull() || formation->OfProduct().IsNull()) return {};
    const std::string name = name_in(formation->OfProduct()->Name());
    return name.empty() ? name_in(formation->OfProduct()->Id()) : name;
  }
};

/// Goes through the faces of a shape in the order of TopExp_Explorer, and knows in which part each of them lies.
void collect_names(const TopoDS_Shape& shape, const NamesInStep& names, const std::string& part, CadFaceNames& found) {
  const auto known = [&](const NamesOfShapes& of) {
    const auto place = of.find(shape.TShape().get());
    return place == of.end() ? std::string() : place->second;
  };
  if (shape.ShapeType() == TopAbs_FACE) {
    found.push_back({known(names.of_faces), part});
    return;
  }
  std::string here = known(names.of_parts);
  if (here.empty()) here = part;
  for (TopoDS_Iterator inner(shape); inner.More(); inner.Next()) collect_names(inner.Value(), names, here, found);
}

/// Of a file with one part only, that part's name says nothing of a face.
CadFaceNames face_names_of(const TopoDS_Shape& shape, const Handle(Transfer_TransientProcess) & transferred) {
  const NamesInStep names(transferred);
  CadFaceNames found;
  collect_names(shape, names, {}, found);
  const bool is_assembly =
      std::ranges::any_of(found, [&](const auto& face) { return face.part != found.front().part; });
  if (!is_assembly) {
    for (CadFaceName& face : found) face.part.clear();
  }
  const auto is_named = [](const CadFaceName& face) { return !face.name.empty() || !face.part.empty(); };
  if (std::ranges::none_of(found, is_named)) found.clear();
  return found;
}

Result<CadShape> read_step(const Input& input) {
  // The end mark is all that tells a whole file from one that was cut at the end of a line.
  const std::string_view tail =
      input.content.substr(input.content.size() - std::min<std::size_t>(input.content.size(), 4096));
  if (tail.find("END-ISO-10303-21") == std::string_view::npos) {
    return input.error_at_byte(input.content.size(),
                               "the STEP file ends without END-ISO-10303-21, it seems to be truncated");
  }
  STEPControl_Reader reader;
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  std::istringstream stream{std::string(input.content)};
  if (reader.ReadStream("input.step", stream) != IFSelect_RetDone) {
    return input.error("is no STEP file that can be understood (ISO 10303-21), export it again");
  }
  CadShape cad;
  TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
  reader.FileUnits(lengths, angles, solid_angles);
  if (!lengths.IsEmpty()) {
    cad.stated_name = lengths.First().ToCString();
    cad.stated_mm = millimetres_in(cad.stated_name);
  }
  reader.TransferRoots();
  if (reader.NbShapes() == 0) {
    return input.error(
        "the STEP file holds no shape that can be read (a tessellated or an empty one?), export it with exact surfaces "
        "(AP203, AP214, AP242), or as STL");
  }
  cad.shape = reader.OneShape();
  if (!cad.shape.IsNull()) cad.face_names = face_names_of(cad.shape, reader.WS()->TransferReader()->TransientProcess());
  return cad;
}

/// The name of a file with this content, for readers that open files themselves.
class OnDisk {
 public:
  static Result<OnDisk> of(const std::filesystem::path& path, const Input& input) {
    std::error_code ignored;
    OnDisk file;
    file.path_ = path;
    if (std::filesystem::is_regular_file(path, ignored) &&
        std::filesystem::file_size(path, ignored) == input.content.size()) {
      return file;
    }
    std::string name = (std::filesystem::temp_directory_path(ignored) / "asbuilt_cad_XXXXXX").string();
    const int descriptor = ::mkstemp(name.data());
    if (descriptor < 0) return input.error("cannot be unpacked: there is no room for a temporary file");
    ::close(descriptor);
    file.path_ = name;
    file.is_temporary_ = true;
    ASBUILT_CHECK(write_file(name, input.content));
    return file;
  }
  OnDisk(OnDisk&& other) noexcept
      : path_(std::move(other.path_)), is_temporary_(std::exchange(other.is_temporary_, false)) {}
  ~OnDisk() {
    std::error_code ignored;
    if (is_temporary_) std::filesystem::remove(path_, ignored);
  }

  [[nodiscard]] std::string name() const { return path_.string(); }

 private:
  OnDisk() = default;
  std::filesystem::path path_;
  bool is_temporary_ = false;
};

Result<CadShape> read_iges(const std::filesystem::path& path, const Input& input) {
  const std::size_t last = input.content.find_last_not_of(" \r\n");
  const std::size_t line = last == std::string_view::npos ? last : input.content.find_last_of("\r\n", last);
  const std::string_view card = line == std::string_view::npos ? "" : input.content.substr(line + 1, last - line);
  if (card.size() < 73 || card[72] != 'T') {
    return input.error_at_byte(input.content.size(),
                               "the IGES file ends without its section T, it seems to be truncated");
  }
  ASBUILT_TRY(file, OnDisk::of(path, input));
  IGESControl_Reader reader;
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  if (reader.ReadFile(file.name().c_str()) != IFSelect_RetDone) {
    return input.error("is no IGES file that can be understood, export it again, or as STEP");
  }
  CadShape cad;
  const Handle(IGESData_IGESModel) model = reader.IGESModel();
  if (!model.IsNull()) {
    const Handle(TCollection_HAsciiString) name = model->GlobalSection().UnitName();
    if (!name.IsNull()) cad.stated_name = name->ToCString();
    cad.stated_mm = millimetres_in(cad.stated_name);
  }
  reader.TransferRoots();
  if (reader.NbShapes() == 0) return input.error("the IGES file holds no surface that can be read, export it as STEP");
  cad.shape = reader.OneShape();
  return cad;
}

/// Whether a BREP text ends as whole ones do: behind the last shape, which a star closes, the shape of the file itself
/// by its orientation, number and place ("+1 0"). OpenCASCADE does not come back from some that were cut before.
bool has_root_of_brep(std::string_view content) {
  const std::size_t star = content.rfind('*');
  if (star == std::string_view::npos) return false;
  std::istringstream rest{std::string(content.substr(star + 1, 100))};
  char orientation = '\0';
  int shape = 0, place = -1;
  return rest >> orientation >> shape >> place &&
         std::string_view("+-ie").find(orientation) != std::string_view::npos && shape > 0 && place >= 0;
}

Result<CadShape> read_brep(const Input& input) {
  if (!has_root_of_brep(input.content)) {
    return input.error_at_byte(input.content.size(),
                               "the BREP file ends without its last line (as '+1 0'), it seems to be truncated");
  }
  CadShape cad;
  std::istringstream stream{std::string(input.content)};
  BRep_Builder builder;
  BRepTools::Read(cad.shape, stream, builder);
  if (cad.shape.IsNull() || stream.fail()) return input.error("is no whole OpenCASCADE BREP file, save it again");
  return cad;
}

Result<CadShape> read_shape(const std::filesystem::path& path, FileKind kind, const Input& input) {
  switch (kind) {
    case FileKind::step:
      return read_step(input);
    case FileKind::iges:
      return read_iges(path, input);
    default:
      return read_brep(input);
  }
}

std::size_t count(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind) {
  std::size_t found = 0;
  for (TopExp_Explorer explorer(shape, kind); explorer.More(); explorer.Next()) ++found;
  return found;
}

/// Triangles of every face at its place, in the order in which the shape has them. An assembly that uses a part twice
/// has its faces twice.
void collect(const TopoDS_Shape& shape, ModelFile& model, std::size_t& untriangulated) {
  model.mesh = {};
  model.cad_faces = 0;
  untriangulated = 0;
  for (TopExp_Explorer explorer(shape, TopAbs_FACE); explorer.More(); explorer.Next(), ++model.cad_faces) {
    const TopoDS_Face& face = TopoDS::Face(explorer.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
    if (triangulation.IsNull() || triangulation->NbTriangles() == 0) {
      ++untriangulated;
      continue;
    }
    const gp_Trsf placement = location.Transformation();
    const auto first = static_cast<int>(model.mesh.vertices.size());
    for (int i = 1; i <= triangulation->NbNodes(); ++i) {
      const gp_Pnt point = triangulation->Node(i).Transformed(placement);
      model.mesh.vertices.emplace_back(point.X(), point.Y(), point.Z());
    }
    const bool is_reversed = (face.Orientation() == TopAbs_REVERSED) != placement.IsNegative();
    for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
      int a = 0, b = 0, c = 0;
      triangulation->Triangle(i).Get(a, b, c);
      if (is_reversed) std::swap(b, c);
      model.mesh.triangles.emplace_back(first + a - 1, first + b - 1, first + c - 1);
      model.mesh.cad_faces.push_back(static_cast<int>(model.cad_faces));
    }
  }
}

void tessellate(const TopoDS_Shape& shape, double deflection_mm) {
  BRepTools::Clean(shape);
  // One thread: the same triangles on every machine.
  BRepMesh_IncrementalMesh(shape, deflection_mm, Standard_False, kAngle, Standard_False);
}

Result<ModelFile> tessellated(const Input& input, const TopoDS_Shape& shape, double tolerance) {
  ModelFile model;
  std::size_t untriangulated = 0;
  Bnd_Box box;
  BRepBndLib::Add(shape, box, Standard_False);
  if (box.IsVoid() || count(shape, TopAbs_FACE) == 0) {
    return input.error("holds no surface, only points or curves; export the part as a solid");
  }
  // The box is that of control points and may be far too large; the diameter of a coarse mesh is not.
  tessellate(shape, kCoarseTolerance * std::sqrt(box.SquareExtent()));
  collect(shape, model, untriangulated);
  const double coarse_diameter = diameter(model.mesh);
  if (!(coarse_diameter > 0.0) || !std::isfinite(coarse_diameter)) {
    return input.error("none of its surfaces could be turned into triangles; export the part again, or as STL");
  }
  tessellate(shape, tolerance * coarse_diameter);
  collect(shape, model, untriangulated);
  if (model.mesh.triangles.empty() || model.mesh.vertices.size() > kMostVertices) {
    return input.error("its surfaces could not be turned into triangles; try a larger --tessellation-tolerance");
  }
  if (untriangulated > 0) {
    model.notes.push_back(fmt::format("{} of {} CAD faces could not be turned into triangles and are missing.",
                                      untriangulated, model.cad_faces));
  }
  model.cad_parts = count(shape, TopAbs_SOLID);
  if (model.cad_parts == 0) model.cad_parts = count(shape, TopAbs_SHELL);
  return model;
}

/// The unit that was taken, and the scale that brings the shape, which is in mm as its file states, to what was said.
double settle_unit(const CadShape& cad, Unit wanted, ModelFile& model) {
  for (const Unit unit : {Unit::millimetre, Unit::centimetre, Unit::metre, Unit::inch, Unit::foot}) {
    if (cad.stated_mm && std::abs(millimetres_per(unit) / *cad.stated_mm - 1.0) < 1e-9) model.unit = unit;
  }
  if (!cad.stated_name.empty() && !cad.stated_mm) {
    model.notes.push_back(
        fmt::format("The file states the unit {}, which OpenCASCADE brought to mm.", in_quotes(cad.stated_name)));
  }
  if (wanted == Unit::stated) return 1.0;
  const double stated_mm = cad.stated_mm.value_or(1.0);
  if (std::abs(millimetres_per(wanted) / stated_mm - 1.0) > 1e-9) {
    model.notes.push_back(fmt::format("The file states {}; as you said, {} was taken instead.",
                                      cad.stated_name.empty() ? "no unit" : in_quotes(cad.stated_name),
                                      name_of(wanted)));
  }
  model.unit = wanted;
  return millimetres_per(wanted) / stated_mm;
}

}  // namespace

bool reads_cad() { return true; }

Result<ModelFile> read_cad(const std::filesystem::path& path, FileKind kind, const Input& input,
                           const ModelReadOptions& options) {
  const std::lock_guard lock(library_mutex());
  silence_library();
  try {
    ASBUILT_TRY(cad, read_shape(path, kind, input));
    if (cad.shape.IsNull()) return input.error("holds no shape");
    ASBUILT_TRY(model, tessellated(input, cad.shape, options.tessellation_tolerance));
    model.format = name_of(kind);
    model.is_cad = true;
    if (cad.face_names.size() == model.cad_faces) model.face_names = std::move(cad.face_names);
    const double scale = settle_unit(cad, options.unit, model);
    for (Eigen::Vector3d& vertex : model.mesh.vertices) vertex *= scale;
    return std::move(model);
  } catch (const Standard_Failure& failure) {
    const char* message = failure.GetMessageString();
    return input.error(fmt::format("OpenCASCADE cannot read it ({})",
                                   in_quotes(message != nullptr && *message != '\0' ? message : "no reason given")));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& failure) {
    return input.error(fmt::format("OpenCASCADE cannot read it ({})", in_quotes(failure.what())));
  }
}

}  // namespace asbuilt::io
