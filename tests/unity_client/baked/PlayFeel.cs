// Plays cases with the C# player: `baked.exe TRUE SOUND` reads {plans, calls, sounds, files}, as schemas/vectors has them, and prints what the
// player makes of each. `baked.exe FILE identity` answers the queries of a file.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using HapticVLM.Baked;
using Map = System.Collections.Generic.Dictionary<string, object>;

public static class PlayFeel
{
    private const int SoundHz = 12000, Block = 120;
    private static Feel felt, sound;

    public static int Main(string[] arguments)
    {
        string file = File.ReadAllText(arguments[0]);
        if (arguments[1] == "identity")
        {
            Console.WriteLine(Text(Identified(BakedScene.Open(file), (Map)Json.Parse(file))));
            return 0;
        }
        felt = Feel.Open(file);
        sound = Feel.Open(File.ReadAllText(arguments[1]));
        var cases = (Map)Json.Parse(Console.In.ReadToEnd());
        Console.WriteLine(Text(new Map
        {
            { "plans", Maps(cases["plans"]).Select(Planned) },
            { "calls", Maps(cases["calls"]).Select(Asked) },
            { "sounds", Maps(cases["sounds"]).Select(Rendered) },
            { "files", ((List<object>)cases["files"]).Select(Refused) },
        }));
        return 0;
    }

    // Answers the queries of tests/identity_cases.json: [id, surface, by], or the nearest id.
    private static IEnumerable<object> Identified(BakedScene bake, Map file)
    {
        bake.SurfaceOf(bake.Find(null) ?? new BakeFound { ObjectId = "no such thing" });
        bake.Find(new BakeQuery { Paths = null });
        bake.Find(new BakeQuery { Paths = new string[] { null } });
        bake.SurfaceOf(new BakeFound { ObjectId = "Twins", Surface = 7 });
        foreach (Map each in Maps(file["queries"]).Select(one => (Map)one["ask"]))
        {
            var query = new BakeQuery { ObjectId = (string)Of(each, "object_id"), Material = (string)Of(each, "material") };
            query.Paths = ((List<object>)Of(each, "paths") ?? new List<object>()).Cast<string>().ToArray();
            query.Primitive = (int?)(double?)Of(each, "primitive");
            query.Surface = (int?)(double?)Of(each, "surface") ?? 0;
            query.Engine = (string)Of(each, "engine") ?? query.Engine;
            BakeFound found = bake.Find(query);
            yield return found == null ? (object)bake.Nearest(query.ObjectId) : new object[] { found.ObjectId, (double)found.Surface, found.By };
        }
    }

    // The plans of each event by form, and what the player told. A case may state surfaces by id, and the gain of the players.
    private static Map Planned(Map one)
    {
        var said = new List<string>();
        var forms = new Dictionary<string, FeelPlayer> { { "amplitude", new FeelPlayer(felt) { Said = said.Add } }, { "parametric", new FeelPlayer(felt) { Said = said.Add } } };
        foreach (FeelPlayer player in forms.Values.Where(_ => Of(one, "gain") != null)) player.Gain = Number(one["gain"]).Value;
        var events = Maps(one["events"]).Select(each => forms.ToDictionary(form => form.Key, form => Done(form.Value, each, form.Key, (Map)Of(one, "surfaces") ?? new Map()))).ToArray();
        return new Map { { "events", events }, { "said", said } };
    }

    private static object Done(FeelPlayer player, Map each, string form, Map surfaces)
    {
        double now = Number(each["at_s"]) ?? double.NaN;
        if (each.ContainsKey("plan")) return PlanOf(player.Plan(each["plan"] as string, form, now));
        if (each.ContainsKey("stop")) player.Stop();
        else if (each.ContainsKey("mute")) player.Mute((string)each["mute"], (bool)each["on"]);
        else player.Touch(TouchOf((Map)each["touch"], surfaces), now);
        return null;
    }

    // The plan of a hand and form while the right hand slides, once the hand was asked and muted.
    private static Map Asked(Map one)
    {
        var said = new List<string>();
        var player = new FeelPlayer(felt) { Said = said.Add };
        player.Touch(new FeltTouch { Phase = "slide", Hand = "right", Surface = new FeltSurface { Material = "wood" } }, 5.0);
        var hand = (string)one["hand"];
        string state = player.IsActive(hand) + " " + player.IsHeld(hand);
        Map plan = PlanOf(player.Plan(hand, (string)one["form"], 5.02));
        player.Mute(hand, true);
        player.Render(null, 1, 5.02);
        player.Render(new float[1], 1000, 5.02);
        return new Map { { "state", state }, { "plan", plan }, { "said", said } };
    }

    // The samples as base64, and the bytes that their second half took.
    private static Map Rendered(Map one)
    {
        var player = new FeelPlayer((string)one["voice"] == "true" ? felt : sound, SoundHz);
        var wave = new float[(int)(double)one["blocks"] * Block];
        var block = new float[Block];
        long taken = 0;
        for (int at = 0; at < wave.Length; at += Block)
        {
            double now = (double)at / SoundHz;
            foreach (Map each in Maps(one["touches"]).Where(each => (double)each["block"] * Block == at)) player.Touch(TouchOf((Map)each["touch"], (Map)Of(one, "surfaces") ?? new Map()), now);
            long before = GC.GetAllocatedBytesForCurrentThread();
            player.Render(block, Block, now);
            if (at > wave.Length / 2) taken += GC.GetAllocatedBytesForCurrentThread() - before;
            block.CopyTo(wave, at);
        }
        var bytes = new byte[4 * wave.Length];
        Buffer.BlockCopy(wave, 0, bytes, 0, bytes.Length);
        return new Map { { "wave", Convert.ToBase64String(bytes) }, { "bytes", (double)taken } };
    }

    private static object Refused(object file)
    {
        try
        {
            Feel.Open((string)file);
            return "";
        }
        catch (FormatException error)
        {
            return error.Message;
        }
    }

    private static FeltTouch TouchOf(Map touch, Map surfaces)
    {
        string id = Of(touch, "object_id") as string ?? "";
        return new FeltTouch
        {
            Phase = touch["phase"] as string,
            Hand = touch["hand"] as string,
            Interaction = Word(Of(touch, "interaction")),
            SpeedMps = Number(Of(touch, "speed_mps")),
            ForceN = Number(Of(touch, "force_n")),
            Surface = SurfaceOf((Map)Of(surfaces, id) ?? new Map { { "material", id } }),
        };
    }

    private static FeltSurface SurfaceOf(Map map)
    {
        object material = Of(map, "material");
        var hum = Of(map, "hum") as Map;
        var drives = hum == null ? null : Of(hum, "drives") as List<object>;
        return new FeltSurface
        {
            Material = material == null ? null : material.ToString(),
            ImpactGain = Number(Of(map, "impact_gain")) ?? 1.0,
            ThicknessM = Number(Of(map, "thickness_m")),
            Hum = hum == null ? null : new FeltHum { FrequencyHz = Number(Of(hum, "frequency_hz")), Level = Number(Of(hum, "level")), Drives = drives == null ? null : drives.Select(each => Number(each) ?? double.NaN).ToArray() },
        };
    }

    // What C# cannot state as a word is a wrong one.
    private static string Word(object value)
    {
        return value == null ? null : value as string ?? "";
    }

    // What C# cannot state as a number is none.
    private static double? Number(object value)
    {
        object number = Unmarked(value);
        return number == null ? null : number is double ? (double?)number : double.NaN;
    }

    // {"$number": "NaN"} is a number that JSON has not.
    private static object Unmarked(object value)
    {
        var map = value as Map;
        return map != null && map.ContainsKey("$number") ? double.Parse((string)map["$number"], CultureInfo.InvariantCulture) : value;
    }

    private static Map PlanOf(FeltPlan plan)
    {
        return new Map
        {
            { "period_ms", 1e3 * plan.PeriodS },
            { "amplitude", plan.Amplitude.Cast<object>() },
            { "frequency_hz", plan.FrequencyHz.Cast<object>() },
            { "transients", plan.Transients.Select(one => (object)new Map { { "amplitude", one.Amplitude }, { "frequency_hz", one.FrequencyHz } }) },
        };
    }

    private static object Of(Map map, string name)
    {
        object value;
        return map.TryGetValue(name, out value) ? value : null;
    }

    private static IEnumerable<Map> Maps(object list)
    {
        return ((List<object>)list).Cast<Map>();
    }

    private static string Text(object value)
    {
        var map = value as System.Collections.IDictionary;
        var list = value as System.Collections.IEnumerable;
        if (value is string) return "\"" + ((string)value).Replace("\\", "\\\\").Replace("\"", "\\\"") + "\"";
        if (map != null) return "{" + string.Join(",", map.Keys.Cast<string>().Select(name => "\"" + name + "\":" + Text(map[name]))) + "}";
        if (list != null) return "[" + string.Join(",", list.Cast<object>().Select(Text)) + "]";
        return value == null ? "null" : ((IFormattable)value).ToString("R", CultureInfo.InvariantCulture);
    }
}
