// The baseline: the runtime's own socket, which only sends prepared messages and reads answers.
using System;
using System.IO;
using System.Net.WebSockets;
using System.Threading;
using HapticVLM;

public sealed class Bare
{
    readonly ClientWebSocket socket = new ClientWebSocket();
    readonly byte[] buffer = new byte[16384];
    long answers;
    bool isOver;

    // The folder holds hello.msg and the encoded frames.
    public static int Soak(string url, string folder, int frames, double rate)
    {
        var bare = new Bare();
        bare.socket.ConnectAsync(new Uri(url), CancellationToken.None).Wait();
        new Thread(bare.Receive) { IsBackground = true }.Start();
        bare.Send(File.ReadAllBytes(Path.Combine(folder, "hello.msg")));
        string[] paths = Directory.GetFiles(folder, "frame*.msg");
        Array.Sort(paths);
        var messages = new byte[paths.Length][];
        for (int i = 0; i < paths.Length; i++) messages[i] = File.ReadAllBytes(paths[i]);
        const int Warm = 60;
        int collections = 0;
        long allocated = 0;
        double started = Clock.Now;
        for (int i = 0; i < frames + Warm; i++)
        {
            if (i == Warm)
            {
                collections = GC.CollectionCount(0);
                started = Clock.Now;
            }
            long before = Machine.AllocatedBytes();
            bare.Send(messages[i % messages.Length]);
            if (i >= Warm) allocated += Machine.AllocatedBytes() - before;
            double due = started + Math.Max(0, i - Warm + 1) / rate - Clock.Now;
            Thread.Sleep(i < Warm ? 1000 / 30 : (int)(Math.Max(0.0, due) * 1000.0));
        }
        collections = GC.CollectionCount(0) - collections;
        double seconds = Clock.Now - started;
        Console.WriteLine("frames " + frames + " seconds " + seconds.ToString("f1") + " bytes_of_the_socket " + allocated / frames
            + " collections " + collections + " answers " + Interlocked.Read(ref bare.answers));
        bare.isOver = true;
        bare.socket.Abort();
        return 0;
    }

    void Send(byte[] message)
    {
        socket.SendAsync(new ArraySegment<byte>(message), WebSocketMessageType.Binary, true, CancellationToken.None).Wait();
    }

    void Receive()
    {
        try
        {
            var into = new ArraySegment<byte>(buffer);
            while (true)
            {
                var part = socket.ReceiveAsync(into, CancellationToken.None).Result;
                if (part.EndOfMessage) Interlocked.Increment(ref answers);
            }
        }
        catch (Exception error)
        {
            if (!isOver) Console.Error.WriteLine(error);
        }
    }
}
