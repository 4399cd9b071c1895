// What the frames say: taken apart, answered, and written.
#pragma once
#include "board.h"

namespace plate {

// Obeys the frame in board.decoder and answers it.
void answer_frame(Board& board);

void send_telemetry(Board& board);

}  // namespace plate
