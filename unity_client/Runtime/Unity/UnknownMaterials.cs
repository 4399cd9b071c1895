using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>Logs stated materials that the service does not know.</summary>
    internal static class UnknownMaterials
    {
        public static void Warn(ICollection<HapticObject> objects, HapticConnection connection)
        {
            foreach (HapticObject target in objects) Warn(target, connection);
        }

        public static void Warn(HapticObject target, HapticConnection connection)
        {
            Check(target.StatedMaterial, connection, target);
        }

        public static bool Check(string material, HapticConnection connection, Object context)
        {
            if (connection.Outbox.Scene.IsKnown(material)) return true;
            Welcome welcome = connection.Welcome;
            string known = welcome == null ? "" : "; it knows " + string.Join(", ", welcome.Materials.ToArray());
            Debug.LogWarning("HapticVLM: the service does not know the material '" + material + "'" + known, context);
            return false;
        }
    }
}
