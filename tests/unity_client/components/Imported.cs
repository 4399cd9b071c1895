// Finds objects of hierarchies, as importers make them at run time, in a bake. A line of standard input is a bake, or names from
// the root on, materials, and the index of the touched one or nothing: "Scene|Cup<TAB>Clay|Glaze<TAB>1".
using System;
using System.Reflection;
using HapticVLM;
using HapticVLM.Baked;
using UnityEngine;

public static class Imported
{
    static void Find()
    {
        var surfaces = Components.Private<object>(FeltRooms.Client(null), "surfaces");
        PropertyInfo baked = surfaces.GetType().GetProperty("Baked");
        for (string line = Console.In.ReadLine(); line != null; line = Console.In.ReadLine())
        {
            if (line[0] == '{') baked.SetValue(surfaces, BakedScene.Open(line));
            else Components.Say("felt " + Felt(line.Split('\t')));
        }
    }

    static string Felt(string[] fields)
    {
        GameObject of = null;
        foreach (string name in fields[0].Split('|'))
        {
            var child = new GameObject(name);
            if (of != null) child.transform.SetParent(of.transform, false);
            of = child;
        }
        Material[] materials = Array.ConvertAll(fields[1].Split('|'), name => new Material { name = name });
        of.AddComponent<MeshRenderer>().sharedMaterials = materials;
        FeltSurface felt = BakedFeel.Find(of, fields[2] == "" ? null : materials[int.Parse(fields[2])]);
        return felt == null ? "nothing" : felt.Material;
    }
}
