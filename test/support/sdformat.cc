// What sdformat reads of URDF and SDF files: for each path on a line of its input a line for each part, with
// tabs between its words, then an empty line. What it complains of begins with "error".
#include <iomanip>
#include <iostream>

#include <sdf/sdf.hh>

namespace {

using ignition::math::Pose3d;
using ignition::math::Vector3d;

void put(const std::string &word) { std::cout << '\t' << word; }

void put(double number) { std::cout << '\t' << number; }

void put(const Vector3d &v) {
  for (const double number : {v.X(), v.Y(), v.Z()}) {
    put(number);
  }
}

void put(const Pose3d &p) {
  put(p.Pos());
  for (const double number : {p.Rot().X(), p.Rot().Y(), p.Rot().Z(), p.Rot().W()}) {
    put(number);
  }
}

void put(const ignition::math::Color &c) {
  for (const double number : {c.R(), c.G(), c.B(), c.A()}) {
    put(number);
  }
}

void begin(const std::string &kind, const std::string &name) {
  std::cout << kind;
  put(name);
}

void complain(const sdf::Errors &errors) {
  for (const auto &error : errors) {
    std::string text = error.Message();
    std::replace(text.begin(), text.end(), '\n', ' ');
    std::cout << "error\t" << text << '\n';
  }
}

Pose3d resolved(const sdf::SemanticPose &semantic, const std::string &to) {
  Pose3d found;
  complain(semantic.Resolve(found, to));
  return found;
}

// The kind of a shape, and its size.
std::pair<std::string, std::vector<double>> geometry(const sdf::Geometry &shape) {
  if (const auto *box = shape.BoxShape()) {
    return {"box", {box->Size().X(), box->Size().Y(), box->Size().Z()}};
  }
  if (const auto *cylinder = shape.CylinderShape()) {
    return {"cylinder", {cylinder->Radius(), cylinder->Length()}};
  }
  if (const auto *sphere = shape.SphereShape()) {
    return {"sphere", {sphere->Radius()}};
  }
  if (const auto *mesh = shape.MeshShape()) {
    return {"mesh", {mesh->Scale().X(), mesh->Scale().Y(), mesh->Scale().Z()}};
  }
  return {shape.Type() == sdf::GeometryType::PLANE ? "plane" : "other", {}};
}

template <typename Shape>
void shape(const std::string &kind, const Shape &given, const std::string &link) {
  const Pose3d pose = resolved(given.SemanticPose(), link);
  const auto [geometry_kind, size] = geometry(*given.Geom());
  begin(kind, given.Name());
  put(geometry_kind);
  put(pose);
  for (const double number : size) {
    put(number);
  }
  std::cout << '\n';
}

void sensor(const sdf::Sensor &given, const std::string &on, const std::string &name) {
  const Pose3d pose = resolved(given.SemanticPose(), name);
  begin("sensor", given.Name());
  put(given.Element()->Get<std::string>("type"));
  put(on);
  put(pose);
  put(given.UpdateRate());
  std::cout << '\n';
}

void joint(const sdf::Joint &given, const std::string &prefix) {
  std::string parent = given.ParentLinkName();
  std::string child = given.ChildLinkName();
  const Pose3d pose = resolved(given.SemanticPose(), given.ChildLinkName());
  const sdf::JointAxis *axis = given.Axis();
  Vector3d xyz;
  if (axis != nullptr) {
    complain(axis->ResolveXyz(xyz, given.ChildLinkName()));
  }
  begin("joint", prefix + given.Name());
  put(given.Element()->Get<std::string>("type"));
  put(parent == "world" ? parent : prefix + parent);
  put(prefix + child);
  put(pose);
  if (axis != nullptr) {
    put(xyz);
    for (const double number : {axis->Damping(), axis->Friction(), axis->SpringStiffness(), axis->SpringReference(),
                                axis->Effort(), axis->MaxVelocity(), axis->Lower(), axis->Upper()}) {
      put(number);
    }
  }
  std::cout << '\n';
  for (uint64_t i = 0; i < given.SensorCount(); ++i) {
    sensor(*given.SensorByIndex(i), prefix + given.Name(), given.Name());
  }
}

void link(const sdf::Link &given, const std::string &prefix, const Pose3d &model) {
  const Pose3d pose = model * resolved(given.SemanticPose(), "__model__");
  const auto inertial = given.Inertial();
  const auto moi = inertial.Moi();
  begin("link", prefix + given.Name());
  put(pose);
  put(inertial.MassMatrix().Mass());
  put(inertial.Pose().Pos());
  for (const double number : {moi(0, 0), moi(0, 1), moi(0, 2), moi(1, 1), moi(1, 2), moi(2, 2)}) {
    put(number);
  }
  put(given.Element()->Get<bool>("gravity", true).first);
  std::cout << '\n';
  for (uint64_t i = 0; i < given.CollisionCount(); ++i) {
    shape("collision", *given.CollisionByIndex(i), given.Name());
  }
  for (uint64_t i = 0; i < given.VisualCount(); ++i) {
    shape("visual", *given.VisualByIndex(i), given.Name());
  }
  for (uint64_t i = 0; i < given.SensorCount(); ++i) {
    sensor(*given.SensorByIndex(i), prefix + given.Name(), given.Name());
  }
}

void links(const sdf::Model &model, const std::string &prefix, const Pose3d &at) {
  for (uint64_t i = 0; i < model.LinkCount(); ++i) {
    link(*model.LinkByIndex(i), prefix, at);
  }
  for (uint64_t i = 0; i < model.ModelCount(); ++i) {
    const sdf::Model &nested = *model.ModelByIndex(i);
    links(nested, prefix + nested.Name() + "::", at * resolved(nested.SemanticPose(), "__model__"));
  }
}

void joints(const sdf::Model &model, const std::string &prefix) {
  for (uint64_t i = 0; i < model.ModelCount(); ++i) {
    joints(*model.ModelByIndex(i), prefix + model.ModelByIndex(i)->Name() + "::");
  }
  for (uint64_t i = 0; i < model.JointCount(); ++i) {
    joint(*model.JointByIndex(i), prefix);
  }
}

void whole(const sdf::Model &model) {
  begin("model", model.Name());
  put(model.RawPose());
  put(model.Static());
  std::cout << '\n';
  links(model, "", Pose3d());
  joints(model, "");
}

void light(const sdf::Light &given) {
  begin("light", given.Name());
  put(given.Element()->Get<std::string>("type"));
  put(given.RawPose());
  put(given.Diffuse());
  put(given.Specular());
  for (const double number : {given.ConstantAttenuationFactor(), given.LinearAttenuationFactor(),
                              given.QuadraticAttenuationFactor()}) {
    put(number);
  }
  put(given.Direction());
  put(given.CastShadows());
  std::cout << '\n';
}

void world(const sdf::World &given) {
  const sdf::Physics *physics = given.PhysicsDefault();
  begin("world", given.Name());
  put(given.Gravity());
  put(physics->MaxStepSize());
  put(physics->Element() ? physics->Element()->Get<double>("real_time_update_rate", 1000.0).first : 1000.0);
  std::cout << '\n';
  for (uint64_t i = 0; i < given.LightCount(); ++i) {
    light(*given.LightByIndex(i));
  }
  for (uint64_t i = 0; i < given.ModelCount(); ++i) {
    whole(*given.ModelByIndex(i));
  }
}

}  // namespace

int main(int, char **arguments) {
  const std::string folder = arguments[1];  // of models
  sdf::setFindCallback([&](const std::string &uri) {
    return folder + "/" + uri.substr(uri.find("://") == std::string::npos ? 0 : uri.find("://") + 3);
  });
  sdf::Console::Instance()->SetQuiet(true);
  std::cout << std::setprecision(17);
  std::string path;
  while (std::getline(std::cin, path)) {
    sdf::Root root;
    complain(root.Load(path));
    for (uint64_t i = 0; i < root.WorldCount(); ++i) {
      world(*root.WorldByIndex(i));
    }
    if (root.Model() != nullptr) {
      whole(*root.Model());
    }
    if (root.Light() != nullptr) {
      light(*root.Light());
    }
    std::cout << std::endl;
  }
  return 0;
}
