// Counts the bytes that one frame and one touch allocate in the package's own code, without the runtime's socket.
// Reads a decision and a telemetry message in hex from stdin.
using System;
using HapticVLM;
using HapticVLM.Wire;

public static class Allocations
{
    public static int PerFrame(int frames)
    {
        var connection = new HapticConnection(new ConnectionSettings());
        int decided = 0;
        connection.Arrivals.Decided += _ => decided++;
        var image = new ArraySegment<byte>(new byte[20000]);
        var decision = new ArraySegment<byte>(Golden.FromHex(Console.ReadLine()));
        var telemetry = new ArraySegment<byte>(Golden.FromHex(Console.ReadLine()));
        long allocated = 0;
        for (int i = -100; i < frames; i++)
        {
            long before = Machine.AllocatedBytes();
            OneFrame(connection, image, decision, telemetry);
            if (i >= 0) allocated += Machine.AllocatedBytes() - before;
        }
        Console.WriteLine("frames " + frames + " decided " + (decided - 100) + " allocated " + allocated);
        return 0;
    }

    static void OneFrame(HapticConnection connection, ArraySegment<byte> image, ArraySegment<byte> decision, ArraySegment<byte> telemetry)
    {
        var frame = new Frame
        {
            CapturedAt = Clock.Now, Format = FrameFormat.Jpeg, Width = 448, Height = 448, Origin = FrameOrigin.Top,
            ObjectId = "table", Image = image,
        };
        connection.Send(ref frame);
        var touch = new Touch
        {
            Phase = Phase.Slide, ObjectId = "table", Hand = HandName.Right, SpeedMps = 0.3, ForceN = 1.5, CapturedAt = Clock.Now,
        };
        connection.Outbox.Touches.Add(ref touch);
        Sent(connection.Outbox);
        connection.Arrivals.Add(decision, Kind.Decision);
        connection.Arrivals.Add(telemetry, Kind.Telemetry);
        connection.Pump(1.0);
    }

    // Does the work of the sending and the receiving side on the messages.
    static void Sent(Outbox outbox)
    {
        for (MsgPackWriter next = outbox.Next(Clock.Now); next != null; next = outbox.Next(Clock.Now))
        {
            long id;
            Protocol.KindOf(next.Written, out id);
            outbox.Requests.MatchAnswer(id, Clock.Now);
        }
    }
}
