// What sdformat reads of a URDF or SDF file, a line for each link, shape and joint.
#include <iomanip>
#include <iostream>

#include <sdf/sdf.hh>

namespace {

void pose(const ignition::math::Pose3d &p) {
  std::cout << ' ' << p.Pos() << ' ' << p.Rot().X() << ' ' << p.Rot().Y() << ' ' << p.Rot().Z() << ' '
            << p.Rot().W();
}

ignition::math::Pose3d resolved(const sdf::SemanticPose &semantic, const std::string &to) {
  ignition::math::Pose3d found;
  for (const auto &error : semantic.Resolve(found, to)) {
    std::cerr << error.Message() << '\n';
  }
  return found;
}

}  // namespace

int main(int, char **arguments) {
  sdf::Root root;
  for (const auto &error : root.Load(arguments[1])) {
    std::cerr << error.Message() << '\n';
  }
  const sdf::Model *model = root.Model();
  if (model == nullptr) {
    return 1;
  }
  std::cout << std::setprecision(17);
  for (uint64_t i = 0; i < model->LinkCount(); ++i) {
    const sdf::Link *link = model->LinkByIndex(i);
    const auto inertial = link->Inertial();
    const auto moi = inertial.Moi();
    std::cout << "link " << link->Name();
    pose(resolved(link->SemanticPose(), "__model__"));
    std::cout << ' ' << inertial.MassMatrix().Mass() << ' ' << inertial.Pose().Pos();
    std::cout << ' ' << moi(0, 0) << ' ' << moi(0, 1) << ' ' << moi(0, 2) << ' ' << moi(1, 1) << ' '
              << moi(1, 2) << ' ' << moi(2, 2) << '\n';
    for (uint64_t k = 0; k < link->CollisionCount(); ++k) {
      const sdf::Collision *shape = link->CollisionByIndex(k);
      std::cout << "collision " << shape->Name();
      pose(resolved(shape->SemanticPose(), link->Name()));
      std::cout << '\n';
    }
    for (uint64_t k = 0; k < link->VisualCount(); ++k) {
      const sdf::Visual *shape = link->VisualByIndex(k);
      std::cout << "visual " << shape->Name();
      pose(resolved(shape->SemanticPose(), link->Name()));
      std::cout << '\n';
    }
    for (uint64_t k = 0; k < link->SensorCount(); ++k) {
      const sdf::Sensor *sensor = link->SensorByIndex(k);
      std::cout << "sensor " << sensor->Name();
      pose(resolved(sensor->SemanticPose(), link->Name()));
      std::cout << '\n';
    }
  }
  for (uint64_t i = 0; i < model->JointCount(); ++i) {
    const sdf::Joint *joint = model->JointByIndex(i);
    std::cout << "joint " << joint->Name() << ' ' << joint->ParentLinkName() << ' ' << joint->ChildLinkName();
    pose(resolved(joint->SemanticPose(), joint->ChildLinkName()));
    if (const sdf::JointAxis *axis = joint->Axis()) {
      ignition::math::Vector3d xyz;
      axis->ResolveXyz(xyz, joint->ChildLinkName());
      std::cout << ' ' << xyz << ' ' << axis->SpringStiffness() << ' ' << axis->SpringReference();
      std::cout << ' ' << axis->Lower() << ' ' << axis->Upper();
    }
    std::cout << '\n';
  }
  return 0;
}
