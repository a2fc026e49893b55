// SPDX-License-Identifier: MIT
// A monitor that is meant to be killed. Ends by itself, with 0, once all samples are followed and stored.
//   child FOLDER SPEED            replays three drives
//   child FOLDER sources N ... M  follows FOLDER/samples.csv and the socket FOLDER/socket; at sample N ...
//                                 acknowledges what there is and sets baselines, then makes FOLDER/acted-N;
//                                 M is the end
//   child FOLDER brokers PORT URL N ... M   likewise a broker of MQTT and a server of NATS
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <monitor/service/log.hpp>
#include <monitor/service/service.hpp>
#include <monitor/sources/file_source.hpp>
#include <monitor/sources/tcp_source.hpp>
#include <resonid/base/error_text.hpp>
#include <string_view>

#include "../monitor_brokers/brokers.hpp"
#include "drive.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;

/// Whether all rows of the samples before `end` are made; the last one stands so far before it at most.
bool followed(const web::Backend& backend, std::uint64_t end, std::uint64_t within) {
  const auto news = backend.axes(0);
  return std::all_of(news.axes.begin(), news.axes.end(),
                     [&](const auto& axis) { return axis.sample + within >= end; });
}

/// Two axes, each from a source by itself.
Installation with_sources(const std::filesystem::path& folder, std::vector<InstalledSource> sources) {
  Installation all = installation(folder, {{}, {}}, 0.0);
  for (std::size_t a = 0; a < 2; ++a) all.axes[a].source = sources[a].name;
  all.sources = std::move(sources);
  return all;
}
Installation sources_installation(const std::filesystem::path& folder) {
  return with_sources(folder,
                      {{"file", "file",
                        [folder](Axes& axes) {
                          return make_file_source({folder / "samples.csv", Format{}}, axes);
                        }},
                       {"tcp", "tcp", [folder](Axes& axes) -> expected<std::unique_ptr<Source>, Error> {
                          TcpSettings settings;
                          settings.address = "unix:" + (folder / "socket").string();
                          auto made = make_tcp_source(settings, axes);
                          if (!made) return tl::unexpected(std::move(made.error()));
                          return std::unique_ptr<Source>(std::move(*made));
                        }}});
}
Installation brokers_installation(const std::filesystem::path& folder, std::uint16_t port,
                                  const std::string& url) {
  return with_sources(folder,
                      {{"mqtt", "mqtt", [port](Axes& axes) { return test::mqtt_source(port, axes); }},
                       {"nats", "nats", [url](Axes& axes) { return test::jetstream_source(url, axes); }}});
}

/// What a person does; comes back once it is stored, or has not been for seconds.
void act(web::Backend& backend) {
  constexpr std::uint32_t kAll = 1000;
  const auto alarms = [&] { return backend.alarms({web::AlarmFilter::unacknowledged, "", kAll}).value(); };
  std::size_t open = 0;
  for (const auto& axis : backend.axes(0).axes) open += axis.unacknowledged;
  for (int i = 0; i < 250 && alarms().size() < open; ++i) std::this_thread::sleep_for(20ms);
  std::this_thread::sleep_for(600ms);  // until those are stored, too, that are suppressed
  std::size_t expected = backend.audit(kAll).value().size();
  web::Action action;
  action.who = "tester";
  action.reason = "seen";
  action.kind = web::ActionKind::acknowledge;
  auto seen = alarms();
  std::sort(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  for (const auto& alarm : seen) {
    action.alarm = alarm.id;
    if (backend.act(action)) ++expected;
  }
  action.kind = web::ActionKind::baseline;
  for (const auto& axis : backend.axes(0).axes) {
    action.axis = axis.name;
    if (backend.act(action)) ++expected;
  }
  for (int i = 0; i < 250 && backend.audit(kAll).value().size() < expected; ++i)
    std::this_thread::sleep_for(20ms);
}

int run(Installation all, const std::filesystem::path& folder, const std::vector<std::uint64_t>& stops,
        std::uint64_t within) {
  auto service = Service::start(std::move(all));
  if (!service) {
    std::fprintf(stderr, "%s\n", message_of(service.error()).c_str());
    return 1;
  }
  std::printf("running\n");
  std::fflush(stdout);
  auto& backend = (*service)->backend();
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const auto acted = folder / ("acted-" + std::to_string(stops[i]));
    if (std::filesystem::exists(acted)) continue;
    while (!followed(backend, stops[i], within)) std::this_thread::sleep_for(5ms);
    if (i + 1 == stops.size()) break;
    act(backend);
    std::ofstream(acted) << "now";
  }
  (*service)->stop();
  return 0;
}

}  // namespace
}  // namespace resonid::monitor

int main(int argc, char** argv) {
  using namespace resonid::monitor;
  if (argc < 3) return 2;
  set_log_level(LogLevel::warning);
  const bool sources = std::string_view(argv[2]) == "sources";
  if (sources || (std::string_view(argv[2]) == "brokers" && argc > 4)) {
    std::vector<std::uint64_t> stops;
    for (int i = sources ? 3 : 5; i < argc; ++i) stops.push_back(std::strtoull(argv[i], nullptr, 10));
    return run(sources
                   ? sources_installation(argv[1])
                   : brokers_installation(argv[1], static_cast<std::uint16_t>(std::atoi(argv[3])), argv[4]),
               argv[1], stops, 1);
  }
  std::vector<std::vector<double>> values;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    values.push_back(drive_samples(110.0, 70.0 + 5.0 * static_cast<double>(seed), seed));
  return run(installation(argv[1], values, std::atof(argv[2])), argv[1], {values[0].size() / 3}, 26);
}
