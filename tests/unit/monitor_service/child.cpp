// SPDX-License-Identifier: MIT
// A monitor that is meant to be killed: child FOLDER SPEED. Ends by itself, with 0, once all samples are
// followed and stored.
#include <cstdio>
#include <cstdlib>
#include <monitor/service/service.hpp>
#include <resonid/base/error_text.hpp>

#include "drive.hpp"

int main(int argc, char** argv) {
  using namespace resonid;
  using namespace resonid::monitor;
  if (argc != 3) return 2;
  std::vector<std::vector<double>> values;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    values.push_back(drive_samples(110.0, 70.0 + 5.0 * static_cast<double>(seed), seed));
  auto service = Service::start(installation(argv[1], values, std::atof(argv[2])));
  if (!service) {
    std::fprintf(stderr, "%s\n", message_of(service.error()).c_str());
    return 1;
  }
  for (const auto& remark : (*service)->remarks()) std::fprintf(stderr, "%s\n", remark.c_str());
  std::printf("running\n");
  std::fflush(stdout);
  while (true) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    bool done = true;
    const auto news = (*service)->backend().axes(0);
    // The last row stands a row's length before the end at most.
    for (const auto& axis : news.axes) done = done && axis.sample + 26 >= values[0].size() / 3;
    if (done) break;
  }
  (*service)->stop();
  return 0;
}
