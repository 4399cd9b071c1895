// Writes valid inputs for the fuzzers: `seeds FOLDER` fills FOLDER/bytes and FOLDER/messages, which must exist.
#include <cstdio>
#include <string>

#include "bench.h"

using namespace plate;

namespace {

struct Said {
    uint8_t type;
    std::vector<uint8_t> payload;
};

const std::vector<std::vector<Said>> TALKS = {
    {{HELLO, {1, 0}}, {SETPOINT, {0xA0, 0x8C, 0, 0, 0xF4, 1}}},
    {{HELLO, {1, 0}}, {SETPOINT, {0x50, 0x46, 0, 0, 1, 0}}, {REST, {}}, {OFF, {}}},
    {{HELLO, {2, 0}}, {SETPOINT, {0x40, 0x9C, 0, 0, 0xE8, 3}}},
    {{HELLO, {1, 0}}, {CLEAR, {1}}, {CLEAR, {13}}, {CLEAR, {255}}},
    {{0x55, {0, 0, 0}}, {SETPOINT, {1}}},
};

void append_sums(std::vector<uint8_t>& bytes) {
    for (double celsius : {30.0, 30.0, 25.0}) {
        const uint16_t sum = sum_at(celsius);
        bytes.push_back((uint8_t)sum);
        bytes.push_back((uint8_t)(sum >> 8));
    }
    bytes.push_back(10);
}

bool write(const std::string& path, const std::vector<uint8_t>& bytes) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (!file) return false;
    const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    return std::fclose(file) == 0 && whole;
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) return 2;
    const std::string folder = arguments[1];
    for (size_t i = 0; i < TALKS.size(); i++) {
        std::vector<uint8_t> line, messages;
        for (const Said& said : TALKS[i]) {
            const auto frame = frame_of(said.type, 1, said.payload);
            line.insert(line.end(), frame.begin(), frame.end());
            messages.push_back(said.type);
            messages.push_back((uint8_t)said.payload.size());
            messages.insert(messages.end(), said.payload.begin(), said.payload.end());
            messages.push_back(1);
            append_sums(messages);
        }
        const std::string name = "/" + std::to_string(i);
        if (!write(folder + "/bytes" + name, line) || !write(folder + "/messages" + name, messages)) return 1;
    }
    return 0;
}
