// A network switch for tests: forwards Ethernet frames between TAP devices, each after a delay.
//   delay_switch DELAY_US DEVICE...
// Creates the devices, prints "ready", and runs until it is killed. Devices may be moved to other
// network namespaces meanwhile.
#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Address = std::array<unsigned char, 6>;

struct Frame {
  Clock::time_point due;
  std::size_t from;
  std::vector<unsigned char> bytes;
};

int open_device(const char* name) {
  const int device = open("/dev/net/tun", O_RDWR | O_NONBLOCK);
  ifreq request{};
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  std::strncpy(request.ifr_name, name, IFNAMSIZ - 1);
  if (device < 0 || ioctl(device, TUNSETIFF, &request) != 0) {
    std::perror(name);
    std::exit(1);
  }
  return device;
}

Address address_at(const Frame& frame, std::size_t offset) {
  Address address{};
  std::memcpy(address.data(), frame.bytes.data() + offset, address.size());
  return address;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: delay_switch DELAY_US DEVICE DEVICE...\n");
    return 2;
  }
  const std::chrono::microseconds delay(std::atol(argv[1]));
  std::vector<pollfd> ports;
  for (int i = 2; i < argc; ++i) ports.push_back({open_device(argv[i]), POLLIN, 0});
  std::puts("ready");
  std::fflush(stdout);

  std::map<Address, std::size_t> port_of;
  std::deque<Frame> waiting;
  std::array<unsigned char, 65536> buffer;
  for (;;) {
    timespec rest{1, 0};
    if (!waiting.empty()) {
      const auto left = std::max(Clock::duration::zero(), waiting.front().due - Clock::now());
      rest = {0, std::chrono::duration_cast<std::chrono::nanoseconds>(left).count()};
    }
    ppoll(ports.data(), ports.size(), &rest, nullptr);
    for (std::size_t port = 0; port < ports.size(); ++port) {
      ssize_t size = 0;
      while ((size = read(ports[port].fd, buffer.data(), buffer.size())) >= 14) {
        waiting.push_back({Clock::now() + delay, port, {buffer.begin(), buffer.begin() + size}});
        port_of[address_at(waiting.back(), 6)] = port;
      }
    }
    while (!waiting.empty() && waiting.front().due <= Clock::now()) {
      const Frame& frame = waiting.front();
      const auto known = port_of.find(address_at(frame, 0));
      for (std::size_t port = 0; port < ports.size(); ++port) {
        if (port == frame.from || (known != port_of.end() && known->second != port)) continue;
        // A full device drops the frame, as a switch does: TCP sends it again.
        if (write(ports[port].fd, frame.bytes.data(), frame.bytes.size()) < 0) continue;
      }
      waiting.pop_front();
    }
  }
}
