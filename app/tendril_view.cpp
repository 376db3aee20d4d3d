// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <stdexcept>

#include "app/client/find_socket.h"
#include "app/program/command_line.h"
#include "app/program/exit_codes.h"
#include "app/program/program.h"
#include "app/program/stop_signal.h"
#include "app/view/view_server.h"

namespace tendril::app {
namespace {

constexpr std::size_t kShortestToken = 12;

int view(const std::filesystem::path& socket, const std::string& listen, const std::string& token) {
  if (!token.empty() && token.size() < kShortestToken)
    throw std::runtime_error(
        fmt::format("--token has at least {} letters, so that nobody guesses it", kShortestToken));
  ViewConfig config{find_socket(socket), read_address(listen), token.empty() ? make_token() : token,
                    read_page(page_folders())};
  if (!config.files.contains("/three.module.js"))
    spdlog::warn("the page has no 3D view: three.js could not be fetched when Tendril was built");
  const std::string secret = config.token;
  ViewServer server(std::move(config));
  const Address address = server.address();
  if (!address.is_loopback())
    spdlog::warn("others on the network can see the robot, and read the token: nothing is encrypted");
  fmt::print("http://{}/#token={}\n", address.text(), secret);
  std::fflush(stdout);
  server.run();
  return kOk;
}

}  // namespace
}  // namespace tendril::app

int main(int argc, char** argv) {
  using namespace tendril;
  app::CommandLine cli{
      "tendril-view shows a running robot in the browser: its body as it deforms, its actuators, its errors. "
      "It serves "
      "one page, and prints its address. The address has a token. A page without it only watches; a page "
      "with it may "
      "take the control and move the robot. Ends on Ctrl-C; the robot goes on.\n\n"
      "Exit codes: 0 ended as asked; 2 wrong usage; 3 the machine lacks something (a port, a daemon's "
      "socket)."};
  std::filesystem::path socket;
  std::string listen = "127.0.0.1:8765", token;
  cli.add("--socket", socket,
          "of the daemon (default: the only one in /run/tendril); the daemon may come later");
  cli.add(
      "--listen", listen,
      "ADDRESS:PORT of the page (default: 127.0.0.1:8765, which only this machine can open); port 0: any");
  cli.add("--token", token, "that the address has (default: a new one each time)");

  return app::run_program("tendril-view", cli, argc, argv, [&] {
    app::watch_stop_signals();
    return app::view(socket, listen, token);
  });
}
