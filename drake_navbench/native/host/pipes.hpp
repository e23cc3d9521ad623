// The two pipes to the benchmark: each message is its length, 4 bytes, and so many bytes.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "message_pack.hpp"

namespace drake_navbench {

class Pipes {
 public:
  // Returns whether there was a message; none comes when the benchmark has gone.
  bool Read(std::string * message) const {
    std::string length;
    if (!ReadBytes(4, &length)) return false;
    std::size_t count = 0;
    for (const char byte : length) count = count << 8 | static_cast<std::uint8_t>(byte);
    return ReadBytes(count, message);
  }

  void Write(const std::string & message) const {
    std::string frame;
    msgpack::AppendBigEndian(&frame, message.size(), 4);
    frame += message;
    for (std::size_t done = 0; done < frame.size();) {
      const ssize_t written = ::write(write_, frame.data() + done, frame.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) std::_Exit(1);
      done += static_cast<std::size_t>(written);
    }
  }

 private:
  static int Descriptor(const char * variable) {
    const char * text = std::getenv(variable);
    if (text == nullptr) throw std::runtime_error(std::string(variable) + " is not set");
    return std::atoi(text);
  }
  bool ReadBytes(std::size_t count, std::string * bytes) const {
    bytes->resize(count);
    for (std::size_t done = 0; done < count;) {
      const ssize_t got = ::read(read_, bytes->data() + done, count - done);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

  int read_ = Descriptor("DRAKE_NAVBENCH_READ_FD");
  int write_ = Descriptor("DRAKE_NAVBENCH_WRITE_FD");
};

}  // namespace drake_navbench
