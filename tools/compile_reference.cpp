// SPDX-License-Identifier: MIT
// The unit in which tools/check_compile_cost measures: what it costs to compile does not depend on this
// project. It is of the kind that most of the project's own sources are. It stays as it is, or the committed
// ratio is taken anew.
#include <Eigen/LU>
#include <map>
#include <string>
#include <vector>

Eigen::VectorXd reference(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                          std::map<std::string, std::vector<double>>& sums) {
  const Eigen::VectorXd x = a.partialPivLu().solve(b);
  for (double v : x) sums[std::to_string(v)].push_back(v);
  return x;
}
