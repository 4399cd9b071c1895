// Decodes and encodes messages from pytest, and fuzzes the codec.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text;
using HapticVLM.Wire;

public static class Golden
{
    static readonly StringPool Pool = new StringPool();

    // In: one message in hex per line. Out: its bytes through its C# type, and its value as JSON,
    // separated by a tab; or "refused".
    public static void Echo(TextReader lines)
    {
        for (string line = lines.ReadLine(); line != null; line = lines.ReadLine())
        {
            try
            {
                byte[] data = FromHex(line);
                string value = ToJson(data);
                Console.WriteLine(Typed(data) + "\t" + value);
            }
            catch (WireException error)
            {
                Console.WriteLine("refused\t" + error.Message);
            }
        }
    }

    // 100,000 inputs: random bytes, and valid messages with bytes changed, cut or added.
    public static int Fuzz(TextReader lines, int count, int seed)
    {
        var seeds = new List<byte[]>();
        for (string line = lines.ReadLine(); line != null; line = lines.ReadLine()) seeds.Add(FromHex(line));
        var random = new Random(seed);
        int fine = 0, refused = 0;
        for (int i = 0; i < count; i++)
        {
            byte[] data = i % 4 == 0 ? Noise(random) : Mutated(seeds[random.Next(seeds.Count)], random);
            try
            {
                if (i % 2 == 0) new MsgPackReader(new ArraySegment<byte>(data)).Skip();
                else Typed(data);
                fine++;
            }
            catch (WireException)
            {
                refused++;
            }
        }
        Console.WriteLine("fine " + fine + " refused " + refused);
        return 0;
    }

    static byte[] Noise(Random random)
    {
        var data = new byte[random.Next(64)];
        random.NextBytes(data);
        return data;
    }

    static byte[] Mutated(byte[] valid, Random random)
    {
        var data = new byte[Math.Max(0, valid.Length + random.Next(-3, 3))];
        Array.Copy(valid, data, Math.Min(valid.Length, data.Length));
        for (int n = random.Next(1, 5); n > 0 && data.Length > 0; n--) data[random.Next(data.Length)] = (byte)random.Next(256);
        return data;
    }

    static string Typed(byte[] data)
    {
        var r = new MsgPackReader(new ArraySegment<byte>(data));
        var w = new MsgPackWriter();
        ReadAndWrite(ref r, w, Protocol.KindOf(new ArraySegment<byte>(data), out long id));
        if (!r.AtEnd) throw new WireException("trailing bytes");
        return Hex(w.Written);
    }

    static void ReadAndWrite(ref MsgPackReader r, MsgPackWriter w, Kind kind)
    {
        switch (kind)
        {
            case Kind.Hello: Hello.Read(ref r, Pool).Write(w); break;
            case Kind.Scene: Scene.Read(ref r, Pool).Write(w); break;
            case Kind.Frame: Frame.Read(ref r, Pool).Write(w); break;
            case Kind.Touch: Touch.Read(ref r, Pool).Write(w); break;
            case Kind.Set: Set.Read(ref r, Pool).Write(w); break;
            case Kind.Stop: Stop.Read(ref r, Pool).Write(w); break;
            case Kind.Welcome: var welcome = new Welcome(); welcome.Read(ref r, Pool); welcome.Write(w); break;
            case Kind.Decision: var decision = new Decision(); decision.Read(ref r, Pool); decision.Write(w); break;
            case Kind.Telemetry: var telemetry = new Telemetry(); telemetry.Read(ref r, Pool); telemetry.Write(w); break;
            case Kind.View: var view = new View(); view.Read(ref r, Pool); view.Write(w); break;
            case Kind.Vibration: var vibration = new Vibration(); vibration.Read(ref r, Pool); vibration.Write(w); break;
            case Kind.Ownership: var ownership = new Ownership(); ownership.Read(ref r, Pool); ownership.Write(w); break;
            case Kind.Textures: var textures = new Textures(); textures.Read(ref r, Pool); textures.Write(w); break;
            case Kind.Skipped: var skipped = new Skipped(); skipped.Read(ref r, Pool); skipped.Write(w); break;
            case Kind.Ok: var ok = new Ok(); ok.Read(ref r, Pool); ok.Write(w); break;
            case Kind.Error: var error = new Error(); error.Read(ref r, Pool); error.Write(w); break;
            default: throw new WireException("no such type");
        }
    }

    static string ToJson(byte[] data)
    {
        var r = new MsgPackReader(new ArraySegment<byte>(data));
        var text = new StringBuilder();
        Show(ref r, text);
        if (!r.AtEnd) throw new WireException("trailing bytes");
        return text.ToString();
    }

    static void Show(ref MsgPackReader r, StringBuilder text)
    {
        switch (r.Peek())
        {
            case MsgPackType.Nil: r.TryNil(); text.Append("null"); break;
            case MsgPackType.Bool: text.Append(r.Bool() ? "true" : "false"); break;
            case MsgPackType.Int: text.Append(r.Int()); break;
            case MsgPackType.Float: text.Append(r.Double().ToString("r", CultureInfo.InvariantCulture)); break;
            case MsgPackType.Str: Quote(r.Str(Pool), text); break;
            case MsgPackType.Bin: text.Append("{\"$bin\":\"" + Hex(r.Bin()) + "\"}"); break;
            case MsgPackType.Array: ShowArray(ref r, text); break;
            default: ShowMap(ref r, text); break;
        }
    }

    static void ShowArray(ref MsgPackReader r, StringBuilder text)
    {
        text.Append('[');
        int count = r.ArrayHeader();
        for (int i = 0; i < count; i++)
        {
            if (i > 0) text.Append(',');
            Show(ref r, text);
        }
        text.Append(']');
    }

    static void ShowMap(ref MsgPackReader r, StringBuilder text)
    {
        text.Append('{');
        int count = r.MapHeader();
        for (int i = 0; i < count; i++)
        {
            if (i > 0) text.Append(',');
            Quote(r.Str(Pool), text);
            text.Append(':');
            Show(ref r, text);
        }
        text.Append('}');
    }

    static void Quote(string value, StringBuilder text)
    {
        text.Append('"');
        foreach (char c in value)
        {
            if (c < 32 || c > 126 || c == '"' || c == '\\') text.Append("\\u" + ((int)c).ToString("x4"));
            else text.Append(c);
        }
        text.Append('"');
    }

    public static byte[] FromHex(string hex)
    {
        var data = new byte[hex.Length / 2];
        for (int i = 0; i < data.Length; i++) data[i] = Convert.ToByte(hex.Substring(2 * i, 2), 16);
        return data;
    }

    static string Hex(ArraySegment<byte> bytes)
    {
        return BitConverter.ToString(bytes.Array, bytes.Offset, bytes.Count).Replace("-", "").ToLowerInvariant();
    }
}
